"""Scene in the browser: created once from the ground, then updated to any instant of the run. z is up.

/ground /goal                          true ground; a trench appears at its time
/rover/chassis/rocker_left/steer_1/... the rover's parts, each turned about its joint
/scan/points /scan/rays                hits of the rays of the running sweep, and the rays of the last turn
/map/surface                           the flight program's map at its last stop, in the colours of the node sets
/paths/driven /paths/believed          paths so far: true, and estimated by the flight program
/paths/global /paths/local /paths/next its last plan: whole path, current leg, next scan position
"""

from __future__ import annotations

import numpy as np
import trimesh
from PIL import Image
from trimesh.visual import TextureVisuals
from trimesh.visual.material import PBRMaterial
from viser import SceneApi, SceneNodeHandle

from hil.view import surfaces
from hil.view.model import Part, about, parts, turns_rad
from hil.view.story import Instant, TrueGround, changed
from hil.view.surfaces import Surface, dashes, lifted, map_surface, on_ground, segments
from hil.world.truth import Patch
from onboard.config import Rover
from onboard.records import F64

ORANGE, AMBER, DARK, STEEL, LIGHT = (214, 92, 10), (245, 150, 40), (58, 58, 62), (165, 168, 172), (230, 230, 226)
RED, BLUE, GREEN, PURPLE, BLACK = (213, 60, 30), (0, 114, 178), (0, 158, 115), (122, 45, 143), (20, 20, 20)
POINT, RAY, SKY = (214, 39, 180), (255, 120, 200), (214, 222, 230)
RAYS_EVERY = 6  # one of this many points of a turn
BODY = (ORANGE, AMBER, STEEL)  # chassis, deck, mast
LAYERS = ("/map", "/paths", "/scan")  # can be hidden


class Scene:
    """Nodes of a viser scene by their names. `show` sends only changes."""

    def __init__(self, api: SceneApi, ground: TrueGround, rover: Rover) -> None:
        self._api, self.ground, self._first = api, ground, ground
        self.nodes: dict[str, SceneNodeHandle] = {}
        self._shown: dict[str, object] = {}
        self._joints = parts(rover)
        api.set_up_direction("+z")
        self._light()
        self._dig(())
        self._goal(ground.goal_m)
        for name in ("/rover", *LAYERS):
            self.nodes[name] = api.add_frame(name, show_axes=False)
        for part in self._joints:
            self._part(part, rover)

    def show(self, instant: Instant) -> None:
        """Update the scene to this instant."""
        self._dig(instant.patches)
        self._pose(instant)
        self._scan(instant)
        for name, way, colour in (("driven", instant.way, BLACK), ("believed", instant.believed_way, GREEN)):
            pieces = segments(on_ground(self.ground, way)) if len(way) > 1 else None
            self._line(f"/paths/{name}", len(way), pieces, colour, 3.0)
        self._plan(instant)

    # -- what stays ------------------------------------------------------------------------------------------------

    def _light(self) -> None:
        """Set a low sun in the north-west, as in the report's pictures, some ambient light, and a pale sky."""
        api = self._api
        api.configure_default_lights(enabled=False)
        api.configure_environment_map(None)
        api.set_background_image(np.full((2, 2, 3), SKY, np.uint8))
        api.add_light_directional("/sun", intensity=3.0, position=(-10.0, 10.0, 9.0))
        api.add_light_ambient("/everywhere", intensity=1.2)

    def _mesh(self, name: str, surface: Surface, opacity: float = 1.0) -> None:
        alpha = np.full((*surface.texture.shape[:2], 1), round(255 * opacity), np.uint8)
        image = Image.fromarray(np.dstack((surface.texture, alpha))[::-1])  # an image begins with its uppermost row
        matt = PBRMaterial(
            baseColorTexture=image,
            metallicFactor=0.0,
            roughnessFactor=1.0,
            alphaMode="OPAQUE" if opacity == 1.0 else "BLEND",
        )
        visual = TextureVisuals(surface.uv, material=matt)
        mesh = trimesh.Trimesh(surface.vertices_m, surface.triangles, process=False, visual=visual)
        self.nodes[name] = self._api.add_mesh_trimesh(name, mesh)

    def _goal(self, goal_m: tuple[float, float]) -> None:
        x, y, z = on_ground(self.ground, np.array([goal_m]))[0]
        api = self._api
        self.nodes["/goal"] = api.add_frame("/goal", show_axes=False, position=(x, y, z))
        self.nodes["/goal/pole"] = api.add_cylinder("/goal/pole", 0.02, 1.2, LIGHT, position=(0, 0, 0.6))
        self.nodes["/goal/flag"] = api.add_box("/goal/flag", RED, (0.36, 0.02, 0.22), position=(0.19, 0, 1.08))
        self.nodes["/goal/name"] = api.add_label("/goal/name", "goal", position=(0, 0, 1.3), anchor="bottom-center")

    def _part(self, part: Part, rover: Rover) -> None:
        name, api = f"/rover/{part.path}", self._api
        self.nodes[name] = api.add_frame(name, show_axes=False, position=part.origin_m)
        for k, box in enumerate(part.boxes):
            colour = STEEL if part.name.startswith("rocker") else BODY[min(k, 2)]
            api.add_box(f"{name}/box_{k}", colour, box.size_m, position=box.centre_m)
        if part.is_wheel:
            lying = about((1.0, 0.0, 0.0), np.pi / 2)
            api.add_cylinder(
                f"{name}/tyre",
                rover.wheel_radius_m,
                rover.wheel_width_m,
                DARK,
                radial_segments=24,
                flat_shading=True,
                wxyz=lying,
            )
            for k, size in enumerate(((1.7, 0.3), (0.3, 1.7))):  # a cross that makes the rotation visible
                size_m = (size[0] * rover.wheel_radius_m, rover.wheel_width_m + 0.012, size[1] * rover.wheel_radius_m)
                api.add_box(f"{name}/spoke_{k}", LIGHT, size_m)
        if part.path == "chassis":
            api.add_cylinder(f"{name}/scanner", 0.04, 0.09, BLACK, position=(rover.lidar_x_m, 0.0, rover.lidar_z_m))

    # -- what changes ----------------------------------------------------------------------------------------------

    def _dig(self, patches: tuple[Patch, ...]) -> None:
        """Show the initial ground with these changes."""
        if self._same("/ground", len(patches)):
            return
        self._remove("/ground")
        self.ground = changed(self._first, patches)
        self._mesh("/ground", surfaces.ground_surface(self.ground))

    def _pose(self, instant: Instant) -> None:
        moment = instant.moment
        x, y, z, w = moment.quaternion_xyzw
        self.nodes["/rover"].position, self.nodes["/rover"].wxyz = moment.position_m, (w, x, y, z)
        angles = turns_rad(moment)
        for part in self._joints[1:]:
            self.nodes[f"/rover/{part.path}"].wxyz = about(part.axis, angles[part.name])

    def _scan(self, instant: Instant) -> None:
        turns = instant.turns
        key = (len(turns), turns[-1].origin_m.tobytes() if turns else b"")
        if self._same("/scan", key):
            return
        points = lifted(np.concatenate([met.points_m for met in turns])) if turns else np.empty((0, 3), np.float32)
        self._remove("/scan/points", "/scan/rays")
        if len(points) == 0:
            return
        self.nodes["/scan/points"] = self._api.add_point_cloud(
            "/scan/points", points, POINT, point_size=0.025, point_shape="circle", precision="float32"
        )
        ends = turns[-1].points_m[::RAYS_EVERY]
        rays = np.stack((np.broadcast_to(turns[-1].origin_m, ends.shape), ends), axis=1)
        self.nodes["/scan/rays"] = self._api.add_line_segments(
            "/scan/rays", rays, RAY, thickness=1.0, thickness_units="screen"
        )

    def _plan(self, instant: Instant) -> None:
        plan = instant.plan
        if self._same("/plan", instant.plan_number):
            return
        self._remove("/map/surface", "/paths/next")
        if plan is not None:
            surface = map_surface(plan)
            if len(surface.triangles):
                self._mesh("/map/surface", surface, 0.6)
            if len(plan.path):
                place = on_ground(self.ground, plan.path[-1:])[0]
                self.nodes["/paths/next"] = self._api.add_icosphere("/paths/next", 0.09, PURPLE, position=place)
        for name, way, colour, lines in (
            ("global", plan.global_path if plan else np.empty((0, 2)), BLUE, dashes),
            ("local", plan.path if plan else np.empty((0, 3)), PURPLE, segments),
        ):
            pieces = lines(on_ground(self.ground, way)) if len(way) > 1 else None
            self._line(f"/paths/{name}", instant.plan_number, pieces, colour, 4.0)

    def _line(self, name: str, key: object, pieces: F64 | None, colour: tuple[int, int, int], width: float) -> None:
        if self._same(name, key):
            return
        self._remove(name)
        if pieces is not None:
            self.nodes[name] = self._api.add_line_segments(
                name, pieces, colour, thickness=width, thickness_units="screen"
            )

    def _same(self, name: str, key: object) -> bool:
        """True if this key is already shown; stores the key."""
        before, self._shown[name] = self._shown.get(name), key
        return before == key

    def _remove(self, *names: str) -> None:
        for name in names:
            node = self.nodes.pop(name, None)
            if node is not None:
                node.remove()
