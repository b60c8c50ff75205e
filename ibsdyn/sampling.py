"""Which variants a study calculates: random ones within tolerances, grids, one at a time, or as listed."""

from __future__ import annotations

import itertools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
import scipy.stats

from ibsdyn.axes import Array
from ibsdyn.errors import ModelError, UnknownNameError, known_keywords
from ibsdyn.parameters import checked_model, nearest_address
from ibsdyn.validation import checked_seed, number

if TYPE_CHECKING:
    from ibsdyn.model import Model

Kind = Literal["monte carlo", "latin hypercube", "full factorial", "one at a time", "variants"]
RANDOM: tuple[Kind, ...] = ("monte carlo", "latin hypercube")
# A factorial grid beyond this is a mistake in the levels rather than a study.
MOST_VARIANTS = 10_000_000


@dataclass(frozen=True, init=False)
class Tolerance:
    """How far a parameter scatters about its nominal value.

    Parameters
    ----------
    address : of the parameter, as ``"mount.kx"``; several that share one draw, as parts of one batch do, in a list.
    sigma : standard deviation of a normal distribution, in the parameter's unit, or
    plus_minus : half width of a uniform one.
    relative : both are shares of the nominal value: 0.05 is 5 %.

    Raises
    ------
    ModelError : not exactly one of the two, or one that is not above 0.
    """

    addresses: tuple[str, ...]
    sigma: float | None
    plus_minus: float | None
    relative: bool

    @known_keywords
    def __init__(
        self,
        address: str | Sequence[str],
        sigma: float | None = None,
        plus_minus: float | None = None,
        relative: bool = False,
    ) -> None:
        listed = (address,) if isinstance(address, str) else tuple(address)
        if not listed or not all(isinstance(each, str) for each in listed):
            raise ModelError(f"Tolerance: address must be a text as 'mount.kx' or a list of those, got {address!r}.")
        what = f"Tolerance of {listed[0]!r}"
        if (sigma is None) == (plus_minus is None):
            raise ModelError(f"{what}: give either sigma= (normal) or plus_minus= (uniform).")
        unit = "of the value" if relative else "in its unit"
        for value, label in ((sigma, "sigma"), (plus_minus, "plus_minus")):
            if value is not None:
                number(value, f"{what}: {label}", unit, above=0.0)
        fields = {"addresses": listed, "sigma": sigma, "plus_minus": plus_minus, "relative": bool(relative)}
        for field, kept in fields.items():
            object.__setattr__(self, field, kept)  # frozen: this is its constructor

    def values(self, nominal: float, share: Array) -> Array:
        """Return values for quantiles (n,) between 0 and 1 of the distribution about a nominal value."""
        scale = abs(nominal) if self.relative else 1.0
        if self.sigma is not None:
            drawn: Array = nominal + scale * self.sigma * scipy.stats.norm.ppf(share)
            return drawn
        assert self.plus_minus is not None  # one of the two, as the constructor saw to
        return nominal + scale * self.plus_minus * (2.0 * share - 1.0)


@dataclass(frozen=True, eq=False)
class Samples:
    """Variants of a model as parameter values.

    Attributes
    ----------
    addresses : p parameters that vary.
    values : (n, p) their values, SI.
    kind : how they came about.
    seed : of the random ones.
    """

    addresses: tuple[str, ...]
    values: Array
    kind: Kind
    seed: int | None = None

    def __len__(self) -> int:
        """Return the number of variants."""
        return len(self.values)

    def __repr__(self) -> str:
        """Name the size and the kind."""
        seed = "" if self.seed is None else f", seed {self.seed}"
        return f"Samples({len(self)} variants of {len(self.addresses)} parameters, {self.kind}{seed})"

    @property
    def random(self) -> bool:
        """Whether shares of them are odds."""
        return self.kind in RANDOM

    def parameters(self, variant: int) -> dict[str, float]:
        """Return the parameters of one variant, counted from 0, by address."""
        return dict(zip(self.addresses, self.values[variant].tolist(), strict=True))


@known_keywords
def monte_carlo(model: Model, tolerances: Tolerance | Sequence[Tolerance], count: int, seed: int = 0) -> Samples:
    """Draw variants at random within tolerances, each parameter (or batch) on its own.

    Parameters
    ----------
    model : whose values are nominal.
    tolerances : ``ibs.Tolerance``, one or several.
    count : how many variants.
    seed : the same seed draws the same variants.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : a parameter twice, one that is locked (inf), or a relative tolerance of 0.
    """
    listed, size = _checked_tolerances(model, tolerances), _count(count, "monte_carlo: count")
    shares = np.random.default_rng(checked_seed(seed)).random((size, len(listed)))
    # 0 itself, which no continuous variable meets, would be minus infinity of a normal distribution.
    return _drawn(model, listed, np.maximum(shares, np.finfo(float).tiny), "monte carlo", seed)


@known_keywords
def latin_hypercube(model: Model, tolerances: Tolerance | Sequence[Tolerance], count: int, seed: int = 0) -> Samples:
    """Draw variants within tolerances that fill the range of every parameter evenly.

    Means and percentiles of smooth quantities need fewer of them than of ``monte_carlo``; confidence intervals, which
    take the variants as independent, are then too wide rather than too narrow.

    Parameters
    ----------
    model, tolerances, count, seed : as of ``monte_carlo``.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : a parameter twice, one that is locked (inf), or a relative tolerance of 0.

    Notes
    -----
    M. D. McKay, R. J. Beckman, W. J. Conover, Technometrics 21 (1979) 239-245; ``scipy.stats.qmc.LatinHypercube``.
    """
    listed, size = _checked_tolerances(model, tolerances), _count(count, "latin_hypercube: count")
    sampler = scipy.stats.qmc.LatinHypercube(len(listed), rng=np.random.default_rng(checked_seed(seed)))
    shares = np.clip(sampler.random(size), np.finfo(float).tiny, np.nextafter(1.0, 0.0))
    return _drawn(model, listed, shares, "latin hypercube", seed)


@known_keywords
def full_factorial(levels: Mapping[str, Sequence[float]]) -> Samples:
    """Return every combination of levels, the last parameter fastest.

    Parameters
    ----------
    levels : values of each parameter by address, as ``{"mount.kx": [1e6, 2e6], "mirror.mass": [0.2, 0.3, 0.4]}``.

    Raises
    ------
    ModelError : no parameter, no level, a level that is no number, or more combinations than can be meant.
    """
    checked = _checked_levels(levels, "full_factorial")
    count = 1
    for values in checked.values():
        count *= len(values)
    if count > MOST_VARIANTS:
        raise ModelError(f"full_factorial: {count} combinations; take fewer levels, or draw with latin_hypercube.")
    return Samples(tuple(checked), np.array(list(itertools.product(*checked.values()))), "full factorial")


@known_keywords
def one_at_a_time(model: Model, levels: Mapping[str, Sequence[float]]) -> Samples:
    """Return variants in which one parameter takes its levels while the others keep the model's values.

    Parameters
    ----------
    model : whose values the others keep.
    levels : values of each parameter by address.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : no parameter, no level, a level that is no number.
    """
    checked = _checked_levels(levels, "one_at_a_time")
    known = checked_model(model, "one_at_a_time").parameters()
    nominal = np.array([_nominal(known, address, "one_at_a_time") for address in checked])
    rows = []
    for place, values in enumerate(checked.values()):
        for value in values:
            row = nominal.copy()
            row[place] = value
            rows.append(row)
    return Samples(tuple(checked), np.array(rows), "one at a time")


@known_keywords
def variants(model: Model, changes: Sequence[Mapping[str, float]]) -> Samples:
    """Return variants as listed; what one of them does not name keeps the model's value.

    Parameters
    ----------
    model : whose values the others keep.
    changes : one dict {address: value} for each variant.

    Raises
    ------
    UnknownNameError : an address that the model does not have.
    ModelError : no variant, or a value that is no number.
    """
    listed = list(changes) if isinstance(changes, (list, tuple)) else []
    if not listed or not all(isinstance(change, Mapping) for change in listed):
        raise ModelError(f"variants: give a list of dicts {{address: value}}, got {changes!r}.")
    addresses = list(dict.fromkeys(address for change in listed for address in change))
    known = checked_model(model, "variants").parameters()
    nominal = {address: _nominal(known, address, "variants") for address in addresses}
    rows = [
        [_level(change.get(address, nominal[address]), f"variants: {address}") for address in addresses]
        for change in listed
    ]
    return Samples(tuple(addresses), np.array(rows, dtype=float).reshape(len(rows), len(addresses)), "variants")


def _drawn(model: Model, tolerances: Sequence[Tolerance], shares: Array, kind: Kind, seed: int) -> Samples:
    nominal = model.parameters()
    addresses, columns = [], []
    for tolerance, share in zip(tolerances, shares.T, strict=True):
        for address in tolerance.addresses:
            addresses.append(address)
            columns.append(tolerance.values(nominal[address], share))
    return Samples(tuple(addresses), np.column_stack(columns), kind, seed)


def _checked_tolerances(model: Model, tolerances: Tolerance | Sequence[Tolerance]) -> list[Tolerance]:
    listed: list[Any] = list(tolerances) if isinstance(tolerances, (list, tuple)) else [tolerances]
    if not listed or not all(isinstance(each, Tolerance) for each in listed):
        raise ModelError(f"tolerances must be ibs.Tolerance, one or a list of them, got {tolerances!r}.")
    known = checked_model(model, "drawing variants").parameters()
    seen: set[str] = set()
    for tolerance in listed:
        for address in tolerance.addresses:
            value = _nominal(known, address, "tolerances")
            if address in seen:
                raise ModelError(f"tolerances: {address!r} is there twice.")
            seen.add(address)
            if not np.isfinite(value):
                raise ModelError(f"tolerances: {address!r} is locked (inf) and cannot scatter.")
            if tolerance.relative and value == 0.0:
                raise ModelError(f"tolerances: {address!r} is 0, so a relative tolerance is none; give it in its unit.")
    return listed


def _checked_levels(levels: object, what: str) -> dict[str, list[float]]:
    if not isinstance(levels, Mapping) or not levels:
        raise ModelError(f"{what}: levels must be a dict {{address: [values]}}, got {levels!r}.")
    checked = {}
    for address, values in levels.items():
        listed = list(values) if isinstance(values, (list, tuple, np.ndarray, range)) else [values]
        if not listed:
            raise ModelError(f"{what}: {address!r} has no level.")
        checked[address] = [_level(value, f"{what}: {address}") for value in listed]
    return checked


def _level(value: object, what: str) -> float:
    # A locked direction (inf) is a level like any other.
    if isinstance(value, (float, np.floating)) and value == np.inf:
        return float(value)
    return number(value, what, "")


def _nominal(known: Mapping[str, float], address: str, what: str) -> float:
    if address not in known:
        raise UnknownNameError(f"{what}: the model has no parameter {address!r}. {nearest_address(address, known)}")
    return known[address]


def _count(value: object, what: str) -> int:
    if isinstance(value, bool) or not isinstance(value, Integral) or value < 1:
        raise ModelError(f"{what} must be a whole number from 1, got {value!r}.")
    return int(value)
