"""The UAV's side of an intervention: policies, plans and proposals.

Enters: what the UAV sees.
Leaves: proposals to UGVs.
May import: `base`, `model`.

`planner` runs once per planning period. For each UGV that needs a proposal it asks the behaviour database (`database`),
which asks the policies in turn. `policy` is the interface of all policies; `detour`, `coordinate` and `wrong` have
those of the package, `guest` runs third-party ones. `messages` has the proposals and answers on the channel. `sim`
wires the planner into the diagram.
"""
