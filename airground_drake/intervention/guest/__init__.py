"""Third-party policies, each in a process of its own.

`process` starts the process and asks it, `worker` runs in it, `confinement` is what the worker gives up first, `codec`
is the format of the messages. `time_limit` limits code in this process. The behaviour database and campaigns use it.
"""
