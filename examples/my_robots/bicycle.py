import numpy as np
from pydrake.systems.framework import BasicVector, LeafSystem


class Bicycle(LeafSystem):
    """A kinematic bicycle: its front wheel is driven and steers. The law steers the point where that wheel touches."""

    def __init__(self, start, *, wheelbase_m=0.4, most_rad=1.2, turn_1_s=8.0):
        """`start` is the middle of the bicycle, (3,), m. It heads along x, and its wheel turns by 1.2 rad at most."""
        super().__init__()
        self.base, self.most, self.turn = wheelbase_m, most_rad, turn_1_s
        self.velocity = self.DeclareVectorInputPort("velocity", 3)
        front = start[:2] + [0.5 * wheelbase_m, 0.0]
        self.DeclareContinuousState(BasicVector([*front, 0.0, 0.0]))  # front wheel, heading, steering angle
        self.DeclareVectorOutputPort("position", 3, self.front)
        self.DeclareVectorOutputPort("body", 3, self.middle)
        self.DeclareVectorOutputPort(
            "heading", 1, lambda context, output: output.SetFromVector([self.state(context)[2]])
        )

    def state(self, context):
        return context.get_continuous_state_vector().CopyToVector()

    def front(self, context, output):
        output.SetFromVector([*self.state(context)[:2], 0.0])

    def middle(self, context, output):
        x, y, heading, _ = self.state(context)
        half = 0.5 * self.base
        output.SetFromVector([x - half * np.cos(heading), y - half * np.sin(heading), 0.0])

    def DoCalcTimeDerivatives(self, context, derivatives):
        """The wheel turns to where the command points, or away from it, and rolls as fast as it leads there."""
        (ux, uy, _), (_, _, heading, steering) = self.velocity.Eval(context), self.state(context)
        along = heading + steering
        speed = ux * np.cos(along) + uy * np.sin(along)
        off = np.arctan(np.tan(np.arctan2(uy, ux) - along)) if np.hypot(ux, uy) > 1e-6 else 0.0
        turn = np.clip(self.turn * off, self.turn * (-self.most - steering), self.turn * (self.most - steering))
        derivatives.SetFromVector(
            [speed * np.cos(along), speed * np.sin(along), speed * np.sin(steering) / self.base, turn]
        )
