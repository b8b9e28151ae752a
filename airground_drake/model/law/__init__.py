"""Null-space-based behavioural control: tasks, composition, set-based avoidance (pure maths)."""
