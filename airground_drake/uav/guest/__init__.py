"""Third-party policies, each in a process of its own.

`process` starts a policy's process and asks it for proposals. `worker` runs in that process, after `confinement` has
limited its rights. `codec` is the format of the messages. `time_limit` limits code in this process. The behaviour
database uses the policies, campaigns the time limit.
"""
