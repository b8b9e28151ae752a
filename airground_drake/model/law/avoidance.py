"""Set-based avoidance: inequality tasks that keep every sampled step at the safe distance.

For a robot at distance D from a point that it must keep away from by d, with n the unit vector away from
that point, the velocity v of one control period h must satisfy

    n.v >= share * A (d - D)     if D <= d    (recover, at the rate of task (8)),
    n.v >= -share * (D - d) / h  otherwise    (do not arrive closer than d),

with share = 1 for an obstacle and 1/2 for each robot of a pair. As ||x + s v|| >= ||x|| + s (x.v)/||x||, the
distance is then at least d during the whole period, whatever velocity the lower priorities ask for: v = 0
satisfies all of them, so a safe choice always exists.

Beside an obstacle that may move at a speed V the robot does nothing that would bring it too near by itself:

    n.v >= -(D - d - V h) / h  if D >= d + V h: whatever the obstacle does, d is kept in this period;
    n.v >= 0                   otherwise: any loss below min(D, d + V h) is due to the obstacle's motion.

Two UGVs that act on old positions of each other (`control.law: asynchronous`) do not share an inequality. With rho the
distance that the other one can drive from its old position, D away, until it decides again,

    n.v >= -(D - d - rho) / h  if D >= d + rho;
    D n.v >= rho ||v||         otherwise: away from every place where it can be. In the plane these are two half-planes.

Where measured positions may be off by e, D is the measured distance and d has e in it (`model.plants.budget`); nearer
than d + V h the robot leads away from every place where the obstacle can be, D n.v >= e ||v||, or stands.

Below these inequalities, and above all other tasks, it retreats: n.v >= V - (D - d) / h, as far as its speed limit
allows. D and d are distances of the robot's centre from the *core* of
what it avoids (`model.geometry.outline`): `World` puts both radii into d.
"""

from dataclasses import dataclass
from typing import Literal, get_args

import numpy as np

from airground_drake.base.arrays import Array
from airground_drake.model.bodies.world import Neighbours
from airground_drake.model.law import kernels
from airground_drake.model.law.kernels import limit_speed as limit_speed

Composition = Literal["augmented", "recursion_nearest", "recursion_listed"]
COMPOSITIONS: tuple[Composition, ...] = get_args(Composition)
_CODES = {"augmented": kernels.AUGMENTED, "recursion_nearest": kernels.RECURSION_NEAREST,
          "recursion_listed": kernels.RECURSION_LISTED}  # fmt: skip


@dataclass(frozen=True)
class HalfSpaces:
    """K velocity constraints for each of n robots: normal . v >= bound."""

    # Unit vectors away from what is avoided, (n, K, 3), with 0 in directions in which the robot cannot move; 0 where
    # out of sensing range.
    normal: Array
    bound: Array  # (n, K), m/s; -inf where out of sensing range

    def slack(self, velocity: Array) -> Array:
        """normal . v - bound for velocities (n, 3) m/s: (n, K) m/s, negative where violated."""
        return np.matmul(self.normal, velocity[..., None])[..., 0] - self.bound


@dataclass(frozen=True)
class Avoidance:
    """The avoidance layer of a team: parameters of the inequalities and of their composition.

    Attributes:
        gain: A of (8), 1/s.
        period: control period h, s; gain * period <= 1 keeps the recovery from overshooting.
        sensing_range: farther points are not seen, m.
        composition: 'augmented' is the KKT point of min ||v - lower||^2 under all constraints: the augmented null-space
            projection over the active set, shortened to be exact in floating point. 'recursion_nearest' and
            'recursion_listed' apply (5) as printed to the same constraints, with the nearest or the first listed
            obstacle as highest priority. They are there to show that (5) is not safe.
        stands: whether a robot stands where no velocity within its speed limit meets all constraints, for positions
            that are measured; by default it takes the least violation. Only with 'augmented'.

    Raises:
        ValueError: if gain or sensing range is negative, the period not positive, or gain or period not finite.
    """

    gain: float
    period: float
    sensing_range: float = np.inf
    composition: Composition = "augmented"
    stands: bool = False

    def __post_init__(self) -> None:
        if not (0.0 <= self.gain < np.inf and 0.0 < self.period < np.inf and self.sensing_range >= 0.0):
            raise ValueError(f"{self}; wanted: finite gain >= 0 and period > 0, sensing_range >= 0")

    @property
    def layer(self) -> kernels.Layer:
        """The parameters for the kernels."""
        stands = self.stands and self.composition == "augmented"
        code = kernels.STANDING if stands else _CODES[self.composition]
        return kernels.Layer(float(self.gain), float(self.period), float(self.sensing_range), code)

    def half_spaces(self, positions: Array, near: Neighbours) -> HalfSpaces:
        """Constraints of k robots with the moving bodies at positions (M, 3) m."""
        if (near.share < 0.0).any():
            raise ValueError("an uncertain position can give two constraints; wanted: no share below 0")
        count = near.distance.shape[1]
        half_spaces = HalfSpaces(np.zeros((len(near.members), count, 3)), np.full((len(near.members), count), -np.inf))
        which, normal, (bound, retreat) = np.empty(count, dtype=np.intp), np.empty((count, 3)), np.empty((2, count))
        around = near.still, near.parts, near.carrier
        for i, member in enumerate(near.members):
            own = positions[member], near.mobility[i], *around, near.others[i], positions
            given = near.distance[i], near.share[i], self.layer, which, normal, bound, retreat
            k = kernels.fill_half_spaces(*own, *given)
            half_spaces.normal[i, which[:k]], half_spaces.bound[i, which[:k]] = normal[:k], bound[:k]
        return half_spaces

    def apply(self, lower: Array, spaces: HalfSpaces) -> Array:
        """Put the avoidance tasks above lower-priority velocities: (n, 3) m/s to (n, 3) m/s."""
        rows = zip(lower, spaces.normal, spaces.bound, strict=True)
        return np.array([kernels.avoid_one(*row, self.layer.composition, np.inf) for row in rows])

    def command(self, lower: Array, positions: Array, near: Neighbours) -> Array:
        """Commands of k robots, (k, 3), m/s: lower-priority velocities (k, 3), limited in speed, below avoidance.

        Args:
            lower: what the tasks below ask for, m/s.
            positions: of all bodies that move, (M, 3), m, world frame.
            near: the robots and what is around them.
        """
        velocity: Array = kernels.commands(lower, positions, near, self.layer)
        return velocity
