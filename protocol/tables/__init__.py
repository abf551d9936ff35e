"""Tables that rover, bench and station share: commands, telemetry, faults, modes."""
