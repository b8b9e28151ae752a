"""The UAV's behaviour database: intervention policies, a plug-in point, and how they take turns."""
