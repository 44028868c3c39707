"""A controller in Python: holds every joint where the nominal robot begins, by a spring kp and a damper kd.

Replace act() by what your robot does; docs/controllers.md tells what it is given and what it promises.
"""


class Controller:
    # What is looked at: the rest is not sensed, which saves time. Without `reads` all is.
    reads = ["joint_position", "joint_velocity"]

    def __init__(self, robot, settings):
        """robot: joint_names, link_names, lower, upper, effort, speed, initial [joints], period (s), lanes, urdf."""
        for name in sorted(settings.keys() - {"kp", "kd"}):
            raise ValueError(f"unknown setting '{name}'; there are: kp, kd")
        self.q0 = robot.initial[:, None]  # [joint, 1]: the same for all lanes
        self.kp = settings.get("kp", 20)  # N m/rad
        self.kd = settings.get("kd", 1)   # N m s/rad
        if self.kp < 0 or self.kd < 0:
            raise ValueError(f"kp ({self.kp}) and kd ({self.kd}) must not be negative")

    def reset(self, lanes, seeds):
        """Traces begin in these lanes: what is kept of them is forgotten. All randomness is to come from the seeds:
        self.random[lane] = numpy.random.default_rng(seed) for each of them. This law remembers nothing."""

    def act(self, observation, targets):
        """One control step of eight robots: arrays are [quantity, lane]; observation.active tells which lanes count."""
        torque = self.kp * (self.q0 - observation.joint_position)
        targets.torque = torque + self.kd * (0 - observation.joint_velocity)
