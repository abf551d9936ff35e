"""The operator's page, `ground serve`: one station session, many browsers, two roles.

command, server   `ground serve`, the server and what it pushes
panels            elements of a browser's page; static/ has their scripts
web               access, guard, routes, STOP
live              the link's thread, short histories, orders
past              past runs of the archive
map               layers, products on the map, buffers of the 3D panel, previews
view              the view model: a snapshot of the station as a tree
"""
