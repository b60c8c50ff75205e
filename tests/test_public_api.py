"""What a user can see: every public name documented, every parameter named in its docstring."""

import inspect

import pytest

import fem_import as fi
import ibsdyn as ibs

FUNCTIONS = [
    ibs.Model.__init__,
    ibs.Model.fixation,
    ibs.Model.rigid_body,
    ibs.Model.flexible_body,
    ibs.Model.connection,
    ibs.Model.replace_with_flexible,
    ibs.Model.linearize,
    ibs.LinearSystem.frf,
    ibs.FrequencyResponse.plot,
    ibs.Modes.plot,
    ibs.Modes.plot_shape,
    ibs.Force.__init__,
    ibs.Torque.__init__,
    ibs.BaseMotion.__init__,
    ibs.Sensor.__init__,
    ibs.Accelerometer.__init__,
    ibs.MotionReconstruction.__init__,
    ibs.PiezoPlatform.__init__,
    ibs.Orientation.__init__,
    ibs.Campaign.__init__,
    ibs.Campaign.simulate,
    ibs.Campaign.read,
    ibs.Campaign.model_frf,
    ibs.Channel.__init__,
    ibs.accelerometer_record,
    ibs.bracket,
    ibs.read_record,
    ibs.required_stiffness,
    ibs.required_frequency,
    ibs.mirror_deflection,
    ibs.distribute_stiffness,
    ibs.leaf_spring,
    ibs.parallel_guide,
    ibs.guide_shortening,
    ibs.cross_flexure,
    ibs.cross_flexure_rotation,
    ibs.notch_hinge,
    ibs.FlatMirror.__init__,
    ibs.BeamPath.__init__,
    ibs.BeamPath.sensor,
    ibs.CombinedSensor.__init__,
    ibs.PSD.__init__,
    ibs.PSD.white,
    ibs.PSD.from_csv,
    ibs.PSD.from_record,
    ibs.PSD.from_third_octaves,
    ibs.PSD.scaled,
    ibs.PSD.plot,
    ibs.floor_vibration,
    ibs.launch_vibration,
    ibs.Disturbance.__init__,
    ibs.CorrelatedDisturbance.__init__,
    ibs.CorrelatedDisturbance.from_cross_spectra,
    ibs.Tone.__init__,
    ibs.vibration_budget,
    ibs.VibrationBudget.plot,
    ibs.VibrationBudget.plot_shares,
    ibs.VibrationBudget.shares,
    ibs.ModeFrequency.__init__,
    ibs.ModeDamping.__init__,
    ibs.ResponseAt.__init__,
    ibs.PeakResponse.__init__,
    ibs.RmsResponse.__init__,
    ibs.Requirement.__init__,
    ibs.half_sine,
    ibs.transient_response,
    ibs.shock_response_spectrum,
    ibs.ShockSpectrum.plot,
    ibs.History.record,
    ibs.History.diff,
    ibs.History.plot,
    ibs.report,
    ibs.estimate_frf,
    ibs.FrfEstimate.plot,
    ibs.FrfEstimate.radius,
    ibs.FrfEstimate.covariance,
    ibs.compare,
    ibs.Comparison.plot,
    ibs.estimate_modes,
    ibs.sensitivities,
    ibs.response_sensitivities,
    ibs.Sensitivities.plot,
    ibs.monte_carlo,
    ibs.latin_hypercube,
    ibs.full_factorial,
    ibs.one_at_a_time,
    ibs.variants,
    ibs.Study.run,
    ibs.StudyResults.plot,
    ibs.fit,
    fi.reduce,
    fi.compare_ties,
    fi.mode_check,
    fi.effective_masses,
    fi.Box.__init__,
    fi.Plane.__init__,
    fi.Cylinder.__init__,
    fi.FEModel.from_arrays,
    fi.ReducedBody.from_arrays,
    fi.ReducedBody.save,
    fi.ReducedBody.reduction_errors,
]


@pytest.mark.parametrize("function", FUNCTIONS, ids=lambda f: f.__qualname__)
def test_every_parameter_is_documented(function):
    owner = function
    if function.__name__ == "__init__":  # a class documents its constructor's parameters itself
        publics = [*vars(ibs).values(), *vars(fi).values()]
        owner = next(public for public in publics if getattr(public, "__init__", None) is function)
    text = inspect.getdoc(owner) or ""
    for name in inspect.signature(function).parameters:
        if name not in ("self", "cls"):
            assert f"{name} :" in text or f"{name}," in text or f", {name} :" in text, f"{name} is not documented"


@pytest.mark.parametrize("package", [ibs, fi])
def test_every_public_name_has_a_docstring(package):
    for name in package.__all__:
        public = getattr(package, name)
        assert inspect.getdoc(public), name
        if inspect.isclass(public) and not issubclass(public, Exception):
            for member, value in vars(public).items():
                if not member.startswith("_") and (inspect.isfunction(value) or isinstance(value, property)):
                    assert inspect.getdoc(value), f"{name}.{member}"


@pytest.mark.parametrize("package", [ibs, fi])
def test_every_error_is_also_the_built_in_a_caller_expects(package):
    builtin = (ValueError, KeyError, OSError, ImportError, TypeError, RuntimeError, Warning)
    for name in package.__all__:
        public = getattr(package, name)
        if inspect.isclass(public) and issubclass(public, Exception):
            base = name in ("IbsdynError", "FemImportError")
            assert base or issubclass(public, builtin), name


def test_results_are_frozen():
    model = ibs.Model("m", axis="x")
    model.fixation("wall")
    body = model.rigid_body("m", mass=1.0)
    model.connection("k", "wall", "m", stiffness=4.0, zeta=0.01)
    system = model.linearize()
    frf = system.frf(ibs.Force("m", "x"), ibs.Sensor("m", "x"), [1.0])
    for result, field in ((body, "inertia"), (system, "K"), (system.modes(), "frequencies"), (frf, "response")):
        with pytest.raises(AttributeError):
            setattr(result, field, None)
    with pytest.raises(TypeError):
        model.items["m"] = body


def test_models_print_their_table_of_components():
    model = ibs.Model("module")
    model.fixation("platform", position=(0, 0, 0.01))
    model.rigid_body("mirror", mass=0.25, cog=(0, 0, 0.08), inertia=(1e-4, 1e-4, 2e-4, 0, 0, 0))
    model.connection(
        "mount", "platform", "mirror", position1=(0, 0, 0.05), stiffness=(1e6,) * 3 + (1e3,) * 3, zeta=0.01
    )
    text = str(model)
    for words in ("module (3-D)", "position (0, 0, 0.01) m", "0.25 kg", "kzz 1000", "zeta 0.01", "Izz 0.0002"):
        assert words in text
    assert repr(model) == "Model('module', 3-D, 2 items, 1 connections)"
    twin = model.copy("other")
    twin.remove("mount")
    assert "mount" in model.connections
    assert "mount" not in twin.connections
