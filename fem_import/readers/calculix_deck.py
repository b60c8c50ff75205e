"""What a CalculiX input deck says about nodes: positions, node sets, rigid bodies."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from fem_import.display import skin_of_solids
from fem_import.errors import ExportError
from fem_import.readers.deck_cards import Card, read_cards
from fem_import.readers.deck_nodes import node_block

_EXPANDED_ELEMENTS = ("S3", "S4", "S6", "S8", "B2", "B3", "CPS", "CPE", "CAX", "M3D", "T2D", "T3D")
# Nodes and corner nodes of the solids whose skin is drawn.
_SOLIDS = {"C3D4": (4, 4), "C3D10": (10, 4), "C3D6": (6, 6), "C3D15": (15, 6), "C3D8": (8, 8), "C3D20": (20, 8)}
_ABAQUS_ASSEMBLY = ("*PART", "*INSTANCE", "*ASSEMBLY")


@dataclass(frozen=True)
class RigidBody:
    """A *RIGID BODY: labels of its reference node and of the node whose DoF 1..3 are the rotations.

    rotation_node is None where the deck leaves it to ccx to add one.
    """

    reference_node: int
    rotation_node: int | None


@dataclass(frozen=True, eq=False)
class Deck:
    """Nodes (labels, positions as written), node sets as spelled, rigid bodies, expanded element types, skin."""

    node_ids: NDArray[np.int64]
    positions: NDArray[np.float64]
    node_sets: dict[str, NDArray[np.int64]]
    rigid_bodies: tuple[RigidBody, ...]
    expanded_elements: tuple[str, ...]
    skin: NDArray[np.int64]  # (t, 3) node labels


def read_deck(path: Path) -> Deck:
    """Read a deck and what it includes. Raises ExportError with file and line, MissingFileError."""
    labels: list[NDArray[np.int64]] = []
    positions: list[NDArray[np.float64]] = []
    sets: dict[str, list[NDArray[np.int64]]] = {}
    spelled: dict[str, str] = {}  # ccx ignores the case of names: the first spelling stands
    rigid_bodies: list[RigidBody] = []
    expanded: list[str] = []
    corners: list[NDArray[np.int64]] = []

    def add_to_set(name: str, members: NDArray[np.int64]) -> None:
        sets.setdefault(spelled.setdefault(name.casefold(), name), []).append(members)

    for card in read_cards(path):
        if card.keyword in _ABAQUS_ASSEMBLY:
            card.refuse("parts and instances are Abaqus' and ccx does not know them. Write a flat deck.")
        elif card.keyword == "*NODE":
            block_labels, block_positions = node_block(card, range(1, 5))
            labels.append(block_labels)
            positions.append(block_positions)
            if "NSET" in card.parameters:
                add_to_set(card.parameters["NSET"], block_labels)
        elif card.keyword == "*NSET":
            name = card.parameters.get("NSET") or card.refuse("the parameter NSET= is missing.")
            add_to_set(name, _set_members(card, sets, spelled))
        elif card.keyword == "*RIGID BODY":
            rigid_bodies.append(_rigid_body(card))
        elif card.keyword == "*ELEMENT":
            element = card.parameters.get("TYPE", "").upper()
            if element.startswith(_EXPANDED_ELEMENTS) and element not in expanded:
                expanded.append(element)
            corners += _solid_corners(card, element)
    if not labels:
        raise ExportError(f"{path} defines no nodes (*NODE), nor does what it includes.")
    node_ids = np.concatenate(labels)
    if len(_in_order(node_ids)) < len(node_ids):
        unique, counts = np.unique(node_ids, return_counts=True)
        raise ExportError(f"{path}: node {unique[counts > 1][0]} is defined {counts.max()} times. Keep one *NODE line.")
    return Deck(
        node_ids=node_ids,
        positions=np.vstack(positions),
        node_sets={name: _in_order(np.concatenate(members)) for name, members in sets.items()},
        rigid_bodies=tuple(rigid_bodies),
        expanded_elements=tuple(expanded),
        skin=skin_of_solids(corners),
    )


def _in_order(labels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the labels ascending, each once, as they mostly stand already."""
    return labels if np.all(labels[1:] > labels[:-1]) else np.unique(labels)


def _solid_corners(card: Card, element: str) -> list[NDArray[np.int64]]:
    """Return the corner labels of a block of solids, for drawing only: nothing where the block is not understood."""
    kind = next((size for name, size in _SOLIDS.items() if element.rstrip("RIMTESB") == name), None)
    if kind is None or not card.data:
        return []
    width = kind[0] + 1
    try:
        numbers = np.loadtxt(card.data, dtype=np.int64, delimiter=",", ndmin=2, comments=None)
    except (ValueError, OverflowError):  # as where an element takes two lines
        try:
            numbers = np.array(",".join(line.rstrip(", ") for line in card.data).split(","), dtype=np.int64)
        except (ValueError, OverflowError):
            return []
    return [numbers.reshape(-1, width)[:, 1 : 1 + kind[1]]] if numbers.size % width == 0 else []


def _set_members(card: Card, sets: dict[str, list[NDArray[np.int64]]], spelled: dict[str, str]) -> NDArray[np.int64]:
    if "ELSET" in card.parameters:
        card.refuse("ELSET= is Abaqus' and ccx ignores it. List the nodes.")
    if "GENERATE" in card.parameters:
        return _generated(card)
    words = ",".join(card.data).replace(" ", "").split(",")
    if all(map(_is_label, words)):
        return np.array([word for word in words if word], dtype=np.int64)
    members: list[NDArray[np.int64]] = []
    labels: list[int] = []
    for word in (word.strip().strip("\"'") for line in card.data for word in line.split(",")):
        if word and _is_label(word):
            labels.append(int(word))
        elif word and word.casefold() in spelled:
            members += sets[spelled[word.casefold()]]
        elif word:
            card.refuse(f"{word!r} is neither a node label nor a set defined above.")
    return np.concatenate([np.array(labels, dtype=np.int64), *members])


def _is_label(word: str) -> bool:
    """Whether a word is a node label, or nothing: a line may end in a comma."""
    return not word or (word.isdecimal() and word.isascii() and len(word) < 16)


def _generated(card: Card) -> NDArray[np.int64]:
    ranges = [np.empty(0, np.int64)]
    for line in card.data:
        words = [word.strip() for word in line.rstrip(", ").split(",")]
        if len(words) not in (2, 3) or not all(word.isdigit() and len(word) < 16 for word in words):
            card.refuse(f"GENERATE expects 'first, last, increment', found {line[:60]!r}.")
        first, last, increment = (*map(int, words), 1)[:3]
        if increment < 1 or last < first or (last - first) // increment > 10**8:
            card.refuse(f"GENERATE {first}, {last}, {increment} names no sensible range.")
        ranges.append(np.arange(first, last + 1, increment, dtype=np.int64))
    return np.concatenate(ranges)


def _rigid_body(card: Card) -> RigidBody:
    nodes: list[int | None] = []
    for parameter in ("REF NODE", "ROT NODE"):
        # ccx takes the blank for optional.
        value = card.parameters.get(parameter, card.parameters.get(parameter.replace(" ", "")))
        if value is not None and not (value.isdigit() and len(value) < 16):
            card.refuse(f"{parameter}={value!r} is not a node label.")
        nodes.append(None if value is None else int(value))
    reference, rotation = nodes
    if reference is None:
        card.refuse("REF NODE= is missing.")
    return RigidBody(reference, rotation)
