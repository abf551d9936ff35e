"""Generated modules: `make codec` makes them from can/rover.dbc and eldorado.xml. Do not edit."""
