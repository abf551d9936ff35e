"""Planning: pose freedom, fields, the global path, the next sensing position, the mission rule, the local planners."""
