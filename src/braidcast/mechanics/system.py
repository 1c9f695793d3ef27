"""Gradient and tangent of the total potential, assembled over the free unknowns."""

from copy import copy
from dataclasses import dataclass, replace

import numba as nb
import numpy as np
import scipy.sparse as sp

from braidcast.mechanics.arrays import IntArray
from braidcast.mechanics.beams import State
from braidcast.mechanics.contact import BeamContact, Contact, ContactForces, lobatto
from braidcast.mechanics.corotational import beam_energy
from braidcast.mechanics.friction import FrictionMemory
from braidcast.mechanics.linear_solvers import Factorise, breadth_first_levels, solver
from braidcast.mechanics.problem import Problem
from braidcast.mechanics.rotations import Array, spin_in_place
from braidcast.mechanics.shared_supports import share_supports


@dataclass(frozen=True)
class Springs:
    """Isotropic springs from nodes to points: ``stiffness`` (N,) N/mm, ``targets`` (N, 3) mm."""

    stiffness: Array
    targets: Array


@dataclass(frozen=True)
class Evaluation:
    """The potential at a state.

    ``strain_energy`` of the beams, mJ; ``gradient`` (n,) over the free unknowns; ``data`` the
    tangent's CSR values; ``nodal`` (N, 6) unbalanced force and moment before supports are applied,
    global axes.
    """

    strain_energy: float
    gradient: Array
    data: Array
    nodal: Array
    contacts: tuple[ContactForces, ...]


class System:
    """A problem with its unknowns numbered and its sparse pattern analysed."""

    def __init__(self, problem: Problem, linear_solver: str = "band_cholesky") -> None:
        self.problem = problem
        net = problem.net
        count = len(net.nodes)
        self.stiffness = np.array(
            [net.section.EA, net.section.GJ, net.section.EIy, net.section.EIz]
        )
        self.contacts = [BeamContact(net, contact) for contact in problem.contacts]
        self._number(count)
        elements = net.elements
        self.element_dofs = np.concatenate(
            [self.dofs[elements[:, 0]], self.dofs[elements[:, 1]]], axis=1
        )
        self.penalty_pairs = np.zeros((0, 2), dtype=np.int64)
        if problem.joints is not None and problem.joints.method == "penalty":
            self.penalty_pairs = np.ascontiguousarray(problem.joints.pairs, dtype=np.int64)
        pairs = self.penalty_pairs
        self.pair_dofs = np.concatenate(
            [self.dofs[pairs[:, 0], :3], self.dofs[pairs[:, 1], :3]], axis=1
        )
        self._analyse()
        self.forces: Array = np.zeros((len(elements), 12))
        self.tangents: Array = np.zeros((len(elements), 12, 12))
        self.diagonal_scale = self._diagonal_scale()
        self.force_weight: Array = np.full(self.size, 1.0 / net.lengths.mean())
        translations = self.dofs[:, :3]
        self.force_weight[translations[translations >= 0]] = 1.0
        self.linear_solver: Factorise = solver(
            linear_solver, self.indptr, self.indices, self._dof_levels()
        )

    def with_contacts(self, contacts: tuple[Contact, ...]) -> "System":
        """The same system against other walls; the analysed pattern is shared, work arrays not."""
        other = copy(self)
        other.forces, other.tangents = np.zeros_like(self.forces), np.zeros_like(self.tangents)
        other.problem = replace(self.problem, contacts=contacts)
        other.contacts = [BeamContact(self.problem.net, contact) for contact in contacts]
        return other

    def _number(self, count: int) -> None:
        """Unknown (N, 6) of every freedom, -1 where prescribed; joined nodes share."""
        problem = self.problem
        master = np.arange(count)
        if problem.joints is not None and problem.joints.method == "shared":
            pairs = np.asarray(problem.joints.pairs)
            graph = sp.csr_matrix((np.ones(len(pairs)), pairs.T), shape=(count, count))
            label = sp.csgraph.connected_components(graph, directed=False)[1]
            first = np.full(label.max() + 1, count)
            np.minimum.at(first, label, master)
            master = first[label]
        self.fixed = np.zeros((count, 6), dtype=bool)
        self.motion: Array = np.zeros((count, 6))
        self.axes: Array = np.tile(np.eye(3), (count, 1, 1))
        if problem.supports is not None:
            self.fixed[:] = problem.supports.fixed
            self.motion[:] = problem.supports.motion
            if problem.supports.axes is not None:
                self.axes[:] = problem.supports.axes
        self.fixed, self.motion, self.axes = share_supports(
            master, self.fixed, self.motion, self.axes
        )
        self.has_axes = bool((self.axes != np.eye(3)).any())
        free = ~self.fixed
        own = free.copy()
        own[master != np.arange(count), :3] = False
        # node by node, a master's joined nodes right behind it, keeps the numbering local
        order = np.argsort(master, kind="stable")
        numbers = np.full((count, 6), -1)
        flat = numbers[order]
        flat[own[order]] = np.arange(int(own.sum()))
        numbers[order] = flat
        numbers[:, :3] = numbers[master, :3]
        numbers[self.fixed] = -1
        self.dofs: IntArray = numbers.astype(np.int64)
        self.size = int(own.sum())
        self.master = master

    def _analyse(self) -> None:
        """CSR pattern of all couplings, and where each element's entries go."""
        n = self.size
        keys = [np.arange(n) * n + np.arange(n)]
        for dofs in (self.element_dofs, self.pair_dofs):
            key = dofs[:, :, None] * n + dofs[:, None, :]
            keys.append(key[(dofs[:, :, None] >= 0) & (dofs[:, None, :] >= 0)])
        unique = np.sort(np.concatenate(keys))
        unique = unique[np.diff(unique, prepend=-1) != 0]
        self.indices = (unique % n).astype(np.int64)
        self.indptr = np.searchsorted(unique, np.arange(n + 1) * n).astype(np.int64)
        self.diagonal = np.searchsorted(unique, keys[0])
        self.element_map = _slots(self.element_dofs, unique, n)
        self.pair_map = _slots(self.pair_dofs, unique, n)

    def _dof_levels(self) -> IntArray:
        levels = self.problem.levels
        count = len(self.dofs)
        if levels is None:
            edges = np.concatenate([self.problem.net.elements, self.penalty_pairs])
            edges = self.master[edges]
            graph = sp.csr_matrix((np.ones(len(edges)), edges.T), shape=(count, count))
            levels = breadth_first_levels(graph + graph.T)[self.master]
        out = np.zeros(self.size, dtype=np.int64)
        free = self.dofs >= 0
        out[self.dofs[free]] = np.repeat(np.asarray(levels)[:, None], 6, axis=1)[free]
        return out

    def _diagonal_scale(self) -> Array:
        """Stiffness scale (n,) of each unknown, for shifts: bending over one element."""
        net = self.problem.net
        length = net.lengths.mean()
        bending = min(net.section.EIy, net.section.EIz)
        scale = np.full(self.size, bending / length)
        translations = self.dofs[:, :3]
        scale[translations[translations >= 0]] = bending / length**3
        return scale

    def evaluate(
        self,
        state: State,
        load_factor: float = 1.0,
        *,
        axial: Array | None = None,
        increment: Array | None = None,
        springs: Springs | None = None,
        memories: tuple[FrictionMemory, ...] | None = None,
        tangent: bool = True,
    ) -> Evaluation:
        """Gradient and tangent at ``state``.

        ``axial`` (M,): axial forces for the geometric stiffness; ``increment`` (N, 6): motion of
        the supports still to come, local axes, whose effect is added to the gradient to first
        order; ``memories``: one for each contact with friction.
        """
        net = self.problem.net
        if axial is None:
            axial = np.full(len(net.elements), np.nan)
        strain_energy = beam_energy(
            state.positions,
            state.rotations,
            net.elements,
            net.triads,
            net.lengths,
            self.stiffness,
            axial,
            self.forces,
            self.tangents,
            tangent,
        )
        contacts = tuple(
            contact.add(
                state,
                self.forces,
                self.tangents,
                tangent,
                None if memories is None else memories[i],
            )
            for i, contact in enumerate(self.contacts)
        )
        nodal = np.zeros((len(net.nodes), 6))
        _gather(net.elements, self.forces, nodal)
        gradient = np.zeros(self.size)
        data = np.zeros(len(self.indices) if tangent else 0)
        if tangent:
            if self.has_axes:
                _to_local_axes(self.tangents, net.elements, self.axes)
            _scatter(self.element_map, self.tangents, data)
            if increment is not None:
                moved = np.concatenate(
                    [increment[net.elements[:, 0]], increment[net.elements[:, 1]]], axis=1
                )
                _add_known(self.element_dofs, self.tangents, moved, gradient)
        if len(self.penalty_pairs):
            self._add_joints(state, nodal, data, increment if tangent else None, gradient)
        if self.problem.loads is not None:
            nodal -= load_factor * self.problem.loads
        if springs is not None:
            nodal[:, :3] += springs.stiffness[:, None] * (state.positions - springs.targets)
            if tangent:
                for i in range(3):
                    dof = self.dofs[:, i]
                    free = dof >= 0
                    np.add.at(data, self.diagonal[dof[free]], springs.stiffness[free])
        local = nodal
        if self.has_axes:
            local = np.concatenate(
                [
                    np.einsum("nji,nj->ni", self.axes, nodal[:, :3]),
                    np.einsum("nji,nj->ni", self.axes, nodal[:, 3:]),
                ],
                axis=1,
            )
        free = self.dofs >= 0
        gradient += np.bincount(self.dofs[free], weights=local[free], minlength=self.size)
        return Evaluation(strain_energy, gradient, data, nodal, contacts)

    def _add_joints(
        self,
        state: State,
        nodal: Array,
        data: Array,
        increment: Array | None,
        gradient: Array,
    ) -> None:
        joints = self.problem.joints
        assert joints is not None
        pairs, k = self.penalty_pairs, joints.stiffness
        moved = state.positions - self.problem.net.nodes
        pull = k * (moved[pairs[:, 0]] - moved[pairs[:, 1]])
        np.add.at(nodal[:, :3], pairs[:, 0], pull)
        np.add.at(nodal[:, :3], pairs[:, 1], -pull)
        if not len(data):
            return
        first = self.axes[pairs[:, 0]]
        mixed = np.einsum("nki,nkj->nij", first, self.axes[pairs[:, 1]])
        tangent = np.zeros((len(pairs), 6, 6))
        tangent[:, :3, :3] = tangent[:, 3:, 3:] = k * np.eye(3)
        tangent[:, :3, 3:] = -k * mixed
        tangent[:, 3:, :3] = -k * mixed.transpose(0, 2, 1)
        _scatter(self.pair_map, tangent, data)
        if increment is not None:
            moved = np.concatenate([increment[pairs[:, 0], :3], increment[pairs[:, 1], :3]], axis=1)
            _add_known(self.pair_dofs, tangent, moved, gradient)

    def step(self, solution: Array, increment: Array | None = None) -> Array:
        """Nodal step (N, 6), global axes, of free unknowns (n,) and the supports' motion (N, 6)."""
        out = np.zeros((len(self.dofs), 6)) if increment is None else increment.copy()
        free = self.dofs >= 0
        out[free] = solution[self.dofs[free]]
        if self.has_axes:
            out[:, :3] = np.einsum("nij,nj->ni", self.axes, out[:, :3])
            out[:, 3:] = np.einsum("nij,nj->ni", self.axes, out[:, 3:])
        return out

    def contact_force_at_nodes(self, contact: ContactForces) -> Array:
        """Normal force (N,) N of a contact, each point's shared by the nodes of its element."""
        elements = self.problem.net.elements
        share = contact.normal.reshape(len(elements), -1)
        points = lobatto(share.shape[1])[0]
        count = len(self.problem.net.nodes)
        nodal = np.zeros(count)
        nodal += np.bincount(elements[:, 0], share @ (1.0 - points), count)
        nodal += np.bincount(elements[:, 1], share @ points, count)
        return nodal

    def at_rest(self, state: State) -> tuple[FrictionMemory, ...]:
        """Memories of walls that hold no slip yet, one for each contact."""
        return tuple(contact.at_rest(state) for contact in self.contacts)


def moved(state: State, step: Array) -> State:
    """The state after a nodal step (N, 6): translations added, spins applied from the left."""
    rotations = state.rotations.copy()
    spin_in_place(rotations, np.ascontiguousarray(step[:, 3:]))
    return State(state.positions + step[:, :3], rotations)


def _slots(dofs: IntArray, keys: IntArray, n: int) -> IntArray:
    """Place (m, k, k) of every entry of small dense blocks in the CSR values; -1 for none."""
    key = dofs[:, :, None] * n + dofs[:, None, :]
    slots = np.searchsorted(keys, key)
    slots[(dofs[:, :, None] < 0) | (dofs[:, None, :] < 0)] = -1
    return slots.astype(np.int32)


@nb.njit(cache=True)
def _scatter(slots: IntArray, blocks: Array, data: Array) -> None:
    for n in range(slots.shape[0]):
        for i in range(slots.shape[1]):
            for j in range(slots.shape[2]):
                if slots[n, i, j] >= 0:
                    data[slots[n, i, j]] += blocks[n, i, j]


@nb.njit(cache=True)
def _gather(elements: IntArray, forces: Array, nodal: Array) -> None:
    for n in range(elements.shape[0]):
        for s in range(2):
            for i in range(6):
                nodal[elements[n, s], i] += forces[n, 6 * s + i]


@nb.njit(cache=True)
def _add_known(dofs: IntArray, blocks: Array, known: Array, gradient: Array) -> None:
    """Gradient of the free unknowns due to prescribed ones, to first order."""
    for n in range(dofs.shape[0]):
        for j in range(dofs.shape[1]):
            if dofs[n, j] >= 0 or known[n, j] == 0.0:
                continue
            for i in range(dofs.shape[1]):
                if dofs[n, i] >= 0:
                    gradient[dofs[n, i]] += blocks[n, i, j] * known[n, j]


@nb.njit(cache=True)
def _to_local_axes(tangents: Array, elements: IntArray, axes: Array) -> None:
    tmp = np.empty((3, 3))
    for n in range(elements.shape[0]):
        for a in range(4):
            left = axes[elements[n, a // 2]]
            for b in range(4):
                right = axes[elements[n, b // 2]]
                for i in range(3):
                    for j in range(3):
                        tmp[i, j] = 0.0
                        for k in range(3):
                            tmp[i, j] += tangents[n, 3 * a + i, 3 * b + k] * right[k, j]
                for i in range(3):
                    for j in range(3):
                        v = 0.0
                        for k in range(3):
                            v += left[k, i] * tmp[k, j]
                        tangents[n, 3 * a + i, 3 * b + j] = v
