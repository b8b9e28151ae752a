import numpy as np

from airground_drake import Motion, Observation, Policy


class AfterYou(Policy):
    """The UGV goes straight to its target; a robot near that line backs off sideways and returns."""

    def propose(self, seen: Observation) -> dict[str, Motion]:
        """A motion for the UGV, and one for each that is in its way."""
        line = seen.target - seen.position
        length = max(float(np.linalg.norm(line)), 1e-3)
        found = {seen.robot: Motion(seen.start + np.array([4.0, 4.0 + length]), np.array([seen.position, seen.target]))}
        aside = 2.0 * seen.robot_distance * np.array([-line[1], line[0], 0.0]) / length
        for mate in seen.team:
            along = np.clip((mate.position - seen.position) @ line / length**2, 0.0, 1.0)
            gap = np.linalg.norm(mate.position - seen.position - along * line)
            taken = mate.proposal is not None and mate.proposal.issued == seen.t
            if mate.name != seen.robot and mate.standing and gap < seen.robot_distance and not taken:
                places = np.array([mate.position, mate.position + aside, mate.position + aside, mate.position])
                found[mate.name] = Motion(seen.start + np.array([0.0, 4.0, 4.0 + length, 8.0 + length]), places)
        return found
