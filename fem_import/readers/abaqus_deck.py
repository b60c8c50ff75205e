"""Nodes and node sets of an Abaqus input deck, flat or as parts and instances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from fem_import.errors import ExportError
from fem_import.readers.deck_cards import Card, read_cards
from fem_import.readers.deck_nodes import node_block
from fem_import.readers.node_table import Nodes

FloatArray: TypeAlias = NDArray[np.float64]
IntArray: TypeAlias = NDArray[np.int64]

_MAKES_NODES = ("*NGEN", "*NFILL", "*NCOPY", "*NMAP")
_LONGEST_RANGE = 10**8
_FLAT_DECK = (
    "Write a flat deck (Abaqus/CAE: mdb.models[name].setValues(noPartsInputFile=ON)) and export the matrices with it."
)


@dataclass
class _Scope:
    """Nodes and sets of the model, of a part or of an instance; names of sets in capitals, as Abaqus has them."""

    labels: list[IntArray] = field(default_factory=list)
    positions: list[FloatArray] = field(default_factory=list)
    sets: dict[str, list[IntArray]] = field(default_factory=dict)
    spelled: dict[str, str] = field(default_factory=dict)
    element_sets: dict[str, list[IntArray]] = field(default_factory=dict)

    def add(self, name: str, members: IntArray) -> None:
        self.sets.setdefault(name.upper(), []).append(members)
        self.spelled.setdefault(name.upper(), name)

    def n_nodes(self) -> int:
        return sum(map(len, self.labels))


def read_abaqus_deck(path: Path) -> Nodes:
    """Read nodes (global positions) and node sets of a flat deck, or of an assembly with one instance.

    A set of the instance that has the name of one of the assembly becomes "instance.name". Several instances
    are refused: Abaqus numbers their nodes anew in the matrices. Raises ExportError, MissingFileError.
    """
    return _Deck(path).nodes()


class _Deck:
    """Goes through the cards once and keeps what belongs to which scope."""

    def __init__(self, path: Path) -> None:
        self._path = path
        self._model = _Scope()
        self._parts: dict[str, _Scope] = {}
        self._instance: _Scope | None = None
        self._instance_name = ""
        self._place: tuple[FloatArray, FloatArray] = (np.eye(3), np.zeros(3))
        self._system: tuple[FloatArray, FloatArray] | None = None
        self._current = self._model
        for card in read_cards(path):
            self._take(card)

    def nodes(self) -> Nodes:
        own, model = self._instance, self._model
        if own is not None and model.n_nodes():
            raise ExportError(
                f"{self._path.name}: the assembly has nodes of its own beside instance {self._instance_name!r}, so "
                f"Abaqus numbers all nodes anew in the matrices. {_FLAT_DECK}"
            )
        if own is None and not model.n_nodes():
            hint = f" Its parts have no *INSTANCE. {_FLAT_DECK}" if self._parts else ""
            raise ExportError(f"{self._path} defines no nodes (*NODE), nor does what it includes.{hint}")
        scope = model if own is None else own
        if not scope.n_nodes():
            raise ExportError(
                f"{self._path.name}: instance {self._instance_name!r} and its part define no nodes (*NODE)."
            )
        labels, positions = np.concatenate(scope.labels), np.vstack(scope.positions)
        unique, counts = np.unique(labels, return_counts=True)
        if len(unique) < len(labels):
            raise ExportError(
                f"{self._path}: node {unique[counts > 1][0]} is defined {counts.max()} times. Keep one *NODE line."
            )
        if own is not None:
            rotation, translation = self._place
            positions = positions @ rotation.T + translation
        sets = {model.spelled[key]: np.unique(np.concatenate(found)) for key, found in model.sets.items()}
        for key, found in (own.sets if own is not None else {}).items():
            name = scope.spelled[key]
            name = f"{self._instance_name}.{name}" if key in model.sets else name
            sets[name] = np.unique(np.concatenate(found))
        return Nodes(labels, positions, sets)

    def _take(self, card: Card) -> None:
        keyword = card.keyword
        if keyword in ("*PART", "*END PART", "*INSTANCE", "*END INSTANCE"):
            self._system = None
        if keyword == "*PART":
            name = card.parameters.get("NAME") or card.refuse("NAME= is missing.")
            self._current = self._parts.setdefault(name.upper(), _Scope())
        elif keyword in ("*END PART", "*END INSTANCE"):
            self._current = self._model
        elif keyword == "*INSTANCE":
            self._open_instance(card)
        elif keyword == "*SYSTEM":
            self._system = _local_system(card) if card.data else None
        elif keyword == "*TRANSFORM":
            card.refuse(
                "it turns the DoF of nodes, so the matrix rows are not in global axes. Remove it and export again."
            )
        elif keyword in _MAKES_NODES:
            card.refuse("nodes that Abaqus makes are not read. Write all nodes as *NODE (Abaqus/CAE does).")
        elif keyword == "*PARAMETER":
            card.refuse(
                "a parametrised deck is not read. Give the .inp that Abaqus writes from it (job.modified or CAE's)."
            )
        elif keyword == "*NODE":
            labels, positions = node_block(card, range(2, 8))
            if self._system is not None:
                rotation, origin = self._system
                positions = positions @ rotation.T + origin
            self._current.labels.append(labels)
            self._current.positions.append(positions)
            if "NSET" in card.parameters:
                self._current.add(card.parameters["NSET"], labels)
        elif keyword == "*NSET":
            name = card.parameters.get("NSET") or card.refuse("NSET= is missing.")
            self._current.add(name, self._set_members(card))
        elif keyword == "*ELEMENT" and "ELSET" in card.parameters:
            self._current.element_sets.setdefault(card.parameters["ELSET"].upper(), []).append(_element_nodes(card))

    def _open_instance(self, card: Card) -> None:
        name = card.parameters.get("NAME") or card.refuse("NAME= is missing.")
        part = card.parameters.get("PART") or card.refuse("PART= is missing.")
        if part.upper() not in self._parts:
            card.refuse(f"part {part!r} is not defined above.")
        if self._instance is not None:
            card.refuse(
                f"a second instance ({name!r} after {self._instance_name!r}): Abaqus numbers the nodes of several "
                "instances "
                f"anew in the matrices. {_FLAT_DECK}"
            )
        self._instance, self._instance_name = self._parts[part.upper()], name
        self._place = _placement(card)
        self._current = self._instance

    def _set_members(self, card: Card) -> IntArray:
        scope = self._current
        instance = card.parameters.get("INSTANCE")
        if instance is not None and (self._instance is None or instance.upper() != self._instance_name.upper()):
            card.refuse(f"instance {instance!r} is not defined above.")
        if "ELSET" in card.parameters:
            found = scope.element_sets.get(card.parameters["ELSET"].upper())
            if found is None:
                card.refuse(
                    f"the nodes of element set {card.parameters['ELSET']!r} are asked, which no *ELEMENT,ELSET= above "
                    "gives. "
                    "List the nodes."
                )
            return np.unique(np.concatenate(found))
        if "GENERATE" in card.parameters:
            return _generated(card)
        labels: list[int] = []
        members: list[IntArray] = []
        for word in (word.strip().strip("\"'") for line in card.data for word in line.split(",")):
            inside = word
            prefix, dot, rest = word.rpartition(".")
            if dot and prefix.upper() == self._instance_name.upper():
                inside = rest
            if inside.isdigit() and inside.isascii() and len(inside) < 16:
                labels.append(int(inside))
            elif word:
                found = self._find_set(scope, inside) if inside == word else self._find_set(self._instance, inside)
                if found is None:
                    card.refuse(f"{word[:60]!r} is neither a node label nor a set defined above.")
                members += found
        return np.concatenate([np.array(labels, dtype=np.int64), *members])

    def _find_set(self, scope: _Scope | None, name: str) -> list[IntArray] | None:
        if scope is not None and name.upper() in scope.sets:
            # One array each: sets of sets of sets must not grow without bound.
            scope.sets[name.upper()] = [np.unique(np.concatenate(scope.sets[name.upper()]))]
            return scope.sets[name.upper()]
        return None


def _element_nodes(card: Card) -> IntArray:
    """Return the labels of a block's nodes; an element goes on after a line that ends in a comma."""
    nodes: list[int] = []
    words: list[str] = []
    for line in card.data:
        words += [word.strip() for word in line.split(",")]
        if not words[-1]:
            words.pop()
            continue
        if not all(word.isdigit() and word.isascii() and len(word) < 16 for word in words):
            card.refuse(f"expected 'label, nodes', found {line[:60]!r}.")
        nodes += [int(word) for word in words[1:]]
        words = []
    return np.unique(np.array(nodes, dtype=np.int64))


def _generated(card: Card) -> IntArray:
    ranges = [np.empty(0, np.int64)]
    length = 0
    for line in card.data:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        if len(words) not in (2, 3) or not all(word.isdigit() and word.isascii() and len(word) < 16 for word in words):
            card.refuse(f"GENERATE expects 'first, last, increment', found {line[:60]!r}.")
        first, last, increment = (*map(int, words), 1)[:3]
        length += (last - first) // max(increment, 1)
        if increment < 1 or last < first or length > _LONGEST_RANGE:
            card.refuse(f"GENERATE {first}, {last}, {increment} names no sensible range.")
        ranges.append(np.arange(first, last + 1, increment, dtype=np.int64))
    return np.concatenate(ranges)


def _placement(card: Card) -> tuple[FloatArray, FloatArray]:
    """Return R, t with x_global = R x + t: a translation, then a turn by degrees about the line a to b."""
    rows = [_numbers(card, line) for line in card.data[:2]]
    translation = np.zeros(3)
    rotation = np.eye(3)
    if rows:
        translation[: min(len(rows[0]), 3)] = rows[0][:3]
    if len(rows) > 1:
        if len(rows[1]) != 7:
            card.refuse(f"the second line turns the instance by seven numbers; found {card.data[1][:60]!r}.")
        start, end, degrees = np.array(rows[1][:3]), np.array(rows[1][3:6]), rows[1][6]
        length = float(np.linalg.norm(end - start))
        if not length > 0.0 or not math.isfinite(length):
            card.refuse("the axis of its turn has no direction.")
        rotation = _turn((end - start) / length, math.radians(degrees))
        translation = rotation @ (translation - start) + start
    return rotation, translation


def _local_system(card: Card) -> tuple[FloatArray, FloatArray]:
    """Return R, t with x_global = R x + t of *SYSTEM, as CAE writes it for the instances of a flat deck.

    First line: the origin and, if turned, a point on the local x axis; second line: one in the xy plane, without
    which z stays and x is projected onto the global xy plane.
    """
    rows = [_numbers(card, line) for line in card.data[:2]]
    rows[0] += [0.0] * (3 - len(rows[0]))
    origin = np.array(rows[0][:3])
    if len(rows[0]) == 3:
        return np.eye(3), origin
    if len(rows[0]) != 6 or (len(rows) > 1 and len(rows[1]) > 3):
        card.refuse(f"expected the origin and a point on the local x axis, found {card.data[0][:60]!r}.")
    x = np.array(rows[0][3:]) - origin
    y = np.array(rows[1] + [0.0] * (3 - len(rows[1]))) - origin if len(rows) > 1 else np.array([-x[1], x[0], 0.0])
    if len(rows) == 1:
        x[2] = 0.0
    z = np.cross(x, y)
    if not np.linalg.norm(z) > 1e-9 * np.linalg.norm(x) * np.linalg.norm(y):
        card.refuse("its points lie on a line.")
    x, z = x / np.linalg.norm(x), z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z]), origin


def _turn(axis: FloatArray, angle: float) -> FloatArray:
    """Return the rotation matrix about a unit vector (Rodrigues)."""
    x, y, z = axis
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.asarray(np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * cross @ cross)


def _numbers(card: Card, line: str) -> list[float]:
    def number(word: str) -> float:
        try:
            value = float(word.upper().replace("D", "E")) if word else 0.0
        except ValueError:
            card.refuse(f"expected numbers, found {line[:60]!r}.")
        if not math.isfinite(value):
            card.refuse(f"expected finite numbers, found {line[:60]!r}.")
        return value

    return [number(word.strip()) for word in line.rstrip(", ").split(",")]
