"""Contact with rigid walls, and friction on them."""

from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
from numpy.typing import ArrayLike

from braidcast.mechanics import (
    BeamNet,
    Contact,
    NewtonOptions,
    Problem,
    Section,
    State,
    Supports,
    follow_path,
)
from braidcast.mechanics.contact import SignedDistance, contact_law
from braidcast.mechanics.equilibrium import Equilibrium, newton
from braidcast.mechanics.rotations import Array, exp_so3
from braidcast.mechanics.surfaces import Cylinder, Plane, Sphere
from braidcast.mechanics.system import System
from problems.elements import SECTION, force_error, tangent_error
from problems.row import Row, relative
from problems.statics import chain

# the law ------------------------------------------------------------------------------------------


def law_errors(stiffness: float = 5000.0, threshold: float = 0.05) -> tuple[float, float]:
    """p against -dPi/dg and p' against differences; jumps of Pi, p, p' at 0 and the threshold."""
    scale = np.array([stiffness * threshold**2, stiffness * threshold, stiffness])

    def law(gap: float) -> Array:
        return np.array(contact_law(gap, stiffness, threshold)) / scale

    derivative = 0.0
    h = 1e-3 * threshold
    for gap in threshold * np.linspace(-2.005, 1.995, 401):
        # Pi is a cubic in each piece: the fourth-order difference is exact
        d = (8 * (law(gap + h) - law(gap - h)) - law(gap + 2 * h) + law(gap - 2 * h)) / (12 * h)
        error = np.abs(law(gap)[1:] + d[:2] * threshold)
        derivative = max(derivative, float(error.max()))
    tiny = 1e-13 * threshold
    jump = max(float(np.abs(law(g + tiny) - law(g - tiny)).max()) for g in (0.0, threshold))
    return derivative, jump


def contact_laws() -> list[Row]:
    derivative, jump = law_errors()
    source = "errata row 10"
    return [
        Row("contact law: p = -dΠ/dg", source, "0", f"{derivative:.1e}", derivative, 1e-10),
        Row("contact law: jumps of Π, p, p'", source, "0", f"{jump:.1e}", jump, 1e-10),
    ]


# forces and tangents ------------------------------------------------------------------------------

WALLS: dict[str, SignedDistance] = {
    "plane": Plane([0.0, 1.2, 0.0], [0.1, 1.0, 0.3]),
    "inside a cylinder": Cylinder(1.4, axis=[1.0, 0.2, 0.1]),
    "outside a cylinder": Cylinder(1.0, [0.0, 1.5, 0.0], [0.3, 0.0, 1.0], outside=True),
    "inside a sphere": Sphere(3.5, [2.0, 0.0, 0.0]),
}


def touching_chain(wall: str) -> tuple[Problem, State]:
    """A chain of three beams, every freedom disturbed, most of it in touch with a wall."""
    rng = np.random.default_rng(3)
    nodes = np.column_stack([np.linspace(0, 4, 4), rng.uniform(0.5, 1.0, 4), rng.normal(0, 0.3, 4)])
    net = BeamNet(nodes, [[0, 1], [1, 2], [2, 3]], SECTION)
    state = State(nodes + rng.uniform(-0.1, 0.1, (4, 3)), exp_so3(rng.uniform(-0.3, 0.3, (4, 3))))
    contact = Contact(WALLS[wall], wire_radius=0.1, stiffness=50.0, threshold=1.0)
    return Problem(net, contacts=(contact,)), state


def contact_derivatives() -> list[Row]:
    # fine steps, for the law's second derivative jumps at the threshold
    force = max(force_error(*touching_chain(wall), h=2e-4) for wall in WALLS)
    tangent = max(tangent_error(*touching_chain(wall), h=2e-4) for wall in WALLS)
    stick = sticking_tangent_error()
    source = "identity"
    name = "contact of a beam, plane, cylinder, sphere"
    return [
        Row(f"{name}: force = dΠ/dx", source, "0", f"{force:.1e}", force, 1e-7),
        Row(f"{name}: tangent against differences", source, "0", f"{tangent:.1e}", tangent, 1e-6),
        Row(
            "friction in stick, plane: tangent against differences",
            source,
            "0",
            f"{stick:.1e}",
            stick,
            1e-6,
        ),
    ]


def sticking_tangent_error() -> float:
    """All of a chain sticks to a plane, from a rest a little off the present state."""
    problem, state = touching_chain("plane")
    contact = replace(problem.contacts[0], threshold=3.0, friction=100.0)
    problem = replace(problem, contacts=(contact,))
    rest = State(state.positions + [0.01, -0.02, 0.03], state.rotations)
    memories = System(problem).at_rest(rest)
    forces = System(problem).evaluate(state, memories=memories).contacts[0]
    assert (forces.tangential > 0.0).all()
    assert (forces.tangential < 0.9 * contact.friction * forces.normal).all()
    return tangent_error(problem, state, memories=memories)


# ring ---------------------------------------------------------------------------------------------

RING = {"radius": 9.490409, "gap": 0.0495914}


@cache
def pressed_ring(elements: int = 96) -> tuple[float, float]:
    """Elastic ring, R0 = 9.5, in a rigid cylinder of radius 10.04: mean radius and gap."""
    angle = 2.0 * np.pi * np.arange(elements) / elements
    radial = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    axial = np.tile([0.0, 0.0, 1.0], (elements, 1))
    axes = np.stack([radial, np.cross(axial, radial), axial], axis=2)
    members = np.column_stack([np.arange(elements), np.roll(np.arange(elements), -1)])
    along = axes[:, :, 1]
    net = BeamNet(
        9.5 * radial,
        members,
        Section.circular(0.5, 100.0, 0.3),
        end_tangents=np.stack([along, np.roll(along, -1, axis=0)], axis=1),
    )
    fixed = np.zeros((elements, 6), dtype=bool)
    fixed[:, [2, 3, 4]] = True
    # free to breathe and to shift, but not to turn as a whole
    fixed[0, 1] = True
    contact = Contact(Cylinder(10.04), wire_radius=0.5, stiffness=5000.0, threshold=0.05)
    problem = Problem(net, supports=Supports(fixed, axes=axes), contacts=(contact,))
    result = follow_path(problem, steps=1)
    assert result.converged, result.reason
    forces = result.evaluation.contacts[0]
    radius = np.linalg.norm(result.state.positions[:, :2], axis=1).mean()
    return float(radius), float(forces.gap.mean())


def rings() -> list[Row]:
    radius, gap = pressed_ring()
    name, source = "ring pressed in a rigid cylinder, 96 elements", "closed form"
    return [
        Row(
            f"{name}: ρ",
            source,
            f"{RING['radius']}",
            f"{radius:.6f}",
            relative(radius, RING["radius"]),
            1e-3,
        ),
        Row(
            f"{name}: gap",
            source,
            f"{RING['gap']}",
            f"{gap:.7f}",
            relative(gap, RING["gap"]),
            1e-3,
        ),
    ]


# capstan ------------------------------------------------------------------------------------------

FRICTION = 0.3
ROPE = Section(EA=100.0, GJ=1e-4, EIy=1e-4, EIz=1e-4)
DRUM_RADIUS, ROPE_RADIUS, ROPE_STIFFNESS, ROPE_THRESHOLD = 1.0, 0.05, 2000.0, 0.01


def rope(elements: int = 80) -> tuple[BeamNet, Contact]:
    """A rope laid over a drum, half a turn, both ends hanging straight down by 2 mm."""
    radius = DRUM_RADIUS + ROPE_RADIUS + ROPE_THRESHOLD
    angle = np.linspace(0.0, np.pi, elements + 1)
    arc = radius * np.column_stack([-np.cos(angle), np.sin(angle), 0 * angle])
    tangents = np.column_stack([np.sin(angle), np.cos(angle), 0 * angle])
    down = np.linspace(0.0, 2.0, 21)[1:, None] * [0.0, -1.0, 0.0]
    nodes = np.concatenate([arc[0] + down[::-1], arc, arc[-1] + down])
    first, last = np.tile([0.0, 1.0, 0.0], (20, 1)), np.tile([0.0, -1.0, 0.0], (20, 1))
    tangents = np.concatenate([first, tangents, last])
    ends = np.stack([tangents[:-1], tangents[1:]], axis=1)
    members = np.column_stack([np.arange(len(nodes) - 1), np.arange(1, len(nodes))])
    contact = Contact(
        Cylinder(DRUM_RADIUS, outside=True),
        ROPE_RADIUS,
        ROPE_STIFFNESS,
        ROPE_THRESHOLD,
        FRICTION,
        stick_stiffness=ROPE_STIFFNESS,
    )
    return BeamNet(nodes, members, ROPE, end_tangents=ends), contact


def in_plane(count: int) -> Array:
    fixed = np.zeros((count, 6), dtype=bool)
    fixed[:, 2:5] = True
    return fixed


def pulled(first: float, last: float) -> Equilibrium:
    """The rope with its ends pulled down by so many mm."""
    net, contact = rope()
    count = len(net.nodes)
    fixed, motion = in_plane(count), np.zeros((count, 6))
    fixed[[0, -1], :2] = True
    motion[[0, -1], 1] = -first, -last
    problem = Problem(net, supports=Supports(fixed, motion), contacts=(contact,))
    result = follow_path(problem, steps=10, options=NewtonOptions(iterations=60))
    assert result.converged, result.reason
    return result


def capstan_ratio() -> float:
    """T2/T1 when one end of the rope is held and the other pulled until all of it slips."""
    first, last = pulled(0.0, 0.2).evaluation.nodal[[0, -1], 1]
    return float(last / first)


def hanging(first: float, last: float) -> Problem:
    """The rope over its drum with dead loads on both ends."""
    net, contact = rope()
    loads = np.zeros((len(net.nodes), 6))
    loads[[0, -1], 1] = -first, -last
    return Problem(
        net, supports=Supports(in_plane(len(net.nodes))), loads=loads, contacts=(contact,)
    )


@cache
def creep(steps: int = 200, cycles: int = 20) -> tuple[float, float]:
    """Drift (mm) of a rope with T2/T1 = 2 < exp(mu theta): held for many steps; per load cycle.

    In a cycle T2 falls to 1.6 T1 and comes back; the drift is that of the last cycle, after the
    rope has shaken down.
    """
    system, relieved = System(hanging(1.0, 2.0)), System(hanging(1.0, 1.6))
    options = NewtonOptions(iterations=60)
    # a slack rope has no stiffness: load it from a slightly stretched state
    seated = pulled(0.01, 0.02).state
    result = follow_path(system.problem, seated, steps=10, options=options, path=(0.2, 1.0))
    assert result.converged, result.reason

    def step(system: System, last: Equilibrium) -> Equilibrium:
        after = newton(system, last.state, options, memories=last.memories)
        assert after.converged, after.reason
        return after

    start = result.state.positions
    for _ in range(steps):
        result = step(system, result)
    held = float(np.abs(result.state.positions - start).max())
    for _ in range(cycles):
        before = result.state.positions
        result = step(system, step(relieved, result))
    return held, float(np.abs(result.state.positions - before).max())


def capstans() -> list[Row]:
    ratio = capstan_ratio()
    exact = float(np.exp(FRICTION * np.pi))
    held, cycled = creep()
    name, source = "rope over a drum, θ = π, μ = 0.3", "Coulomb"
    return [
        Row(
            f"{name}: T2/T1",
            "Euler & Eytelwein",
            f"{exact:.4f}",
            f"{ratio:.4f}",
            relative(ratio, exact),
            1e-2,
        ),
        Row(
            f"{name}, T2/T1 = 2: drift in 200 steps, mm", "Coulomb", "0", f"{held:.1e}", held, 1e-6
        ),
        Row(
            f"{name}, T2/T1 = 1.6 to 2: drift in the 20th cycle, mm",
            source,
            "0",
            f"{cycled:.1e}",
            cycled,
            1e-6,
        ),
    ]


# a rod dragged over a plane -----------------------------------------------------------------------


def pressed_rod(pull: ArrayLike) -> Problem:
    """A rod on a plane, pressed on it by 1 N a node and pulled within the plane by ``pull``, N."""
    nodes = np.zeros((5, 3))
    nodes[:, 0] = np.arange(5.0)
    nodes[:, 2] = 0.1 + 0.005
    loads = np.zeros((5, 6))
    loads[:, 2] = -1.0
    loads[:, :2] = np.asarray(pull) / 5.0
    fixed = np.zeros((5, 6), dtype=bool)
    fixed[:, 3] = True
    contact = Contact(Plane([0, 0, 0], [0, 0, -1]), 0.1, 1e3, 0.01, FRICTION, stick_stiffness=1e3)
    return Problem(
        chain(nodes, Section(1e3, 1.0, 10.0, 10.0)),
        supports=Supports(fixed),
        loads=loads,
        contacts=(contact,),
    )


def rests(problem: Problem) -> bool:
    """Whether the rod finds an equilibrium before it has slid away."""
    options = NewtonOptions(iterations=40)
    return follow_path(problem, steps=4, smallest_step=0.01, options=options).converged


def dragged() -> float:
    """Pull over normal force of a rod moved over a plane along its axis."""
    problem = pressed_rod([0.0, 0.0])
    assert problem.supports is not None
    fixed, motion = problem.supports.fixed.copy(), np.zeros((5, 6))
    fixed[-1, 0] = True
    motion[-1, 0] = 0.1
    result = follow_path(replace(problem, supports=Supports(fixed, motion)), steps=4)
    assert result.converged, result.reason
    return float(result.evaluation.nodal[-1, 0] / result.evaluation.contacts[0].total)


def drags() -> list[Row]:
    ours = dragged()
    name = "rod dragged over a plane: pull / normal force"
    return [Row(name, "Coulomb", f"{FRICTION}", f"{ours:.9f}", relative(ours, FRICTION), 1e-6)]


PROBLEMS: tuple[Callable[[], list[Row]], ...] = (
    contact_laws,
    contact_derivatives,
    rings,
    capstans,
    drags,
)
