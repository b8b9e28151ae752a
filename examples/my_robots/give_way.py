"""A controller of the UGVs: along the preset trajectory, unless a UGV before it in the order is near."""

import numpy as np
from pydrake.systems.framework import LeafSystem


class GiveWay(LeafSystem):
    """Each UGV goes to where its preset is, and stands while a UGV before it in the order is nearer than `room_m`."""

    def __init__(self, world, law, *, room_m):
        """`world` has all bodies, `law` is the package's with its gains and period; parameters are numbers."""
        super().__init__()
        self.count, self.room = len(world.names("ugv")), room_m
        self.most = np.array([body.max_speed_m_s for body in world.bodies[: self.count]])[:, None]
        self.bodies = self.DeclareVectorInputPort("bodies", 3 * len(world.moving))
        self.reference = self.DeclareVectorInputPort("reference", 6 * self.count)
        command, executing = self.DeclareDiscreteState(3 * self.count), self.DeclareDiscreteState([-1.0] * self.count)
        self.DeclareStateOutputPort("command", command)
        self.DeclareStateOutputPort("executing", executing)  # it follows no proposal
        gains = [law.avoidance.gain, law.motion_gain, law.intervention_gain]
        self.DeclareVectorOutputPort("gains", 3, lambda context, output: output.SetFromVector(gains))
        self.DeclarePeriodicDiscreteUpdateEvent(law.avoidance.period, 0.0, self.update)

    def update(self, context, discrete):
        """Commands for the control period that begins."""
        place = self.bodies.Eval(context).reshape(-1, 3)[: self.count]
        wanted, rate = self.reference.Eval(context).reshape(2, -1, 3)
        velocity = rate + 2.0 * (wanted - place)
        speed = np.linalg.norm(velocity, axis=1, keepdims=True)
        velocity *= np.minimum(1.0, self.most / np.maximum(speed, 1e-9))
        for i in range(1, self.count):
            velocity[i] *= np.linalg.norm(place[:i] - place[i], axis=1).min() > self.room
        discrete.set_value(0, velocity.ravel())
