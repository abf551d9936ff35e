"""Rover on its ground, by pybullet: the engine simulates bodies and rocks, hil.plant.soil the wheels on soil.

Only this file, ground_bodies.py and hil/plant/rays/engine_rays.py use the engine. Same field, seed, step and commands
give the same bits. Engine traps that shape this file (all are in docs/engine.md): by default links have a damping of
0.04 and joints a motor; the base's pose is that of its centre of mass; an external force lasts for one step; a rover
off the mesh falls without end and without an error.
"""

from __future__ import annotations

import math
import tempfile
from collections import deque
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hil.plant.engine import BODY, ROCK, SOIL, WHEEL, pybullet
from hil.plant.ground_bodies import Ground
from hil.plant.patches import Patches
from hil.plant.rover_model import CENTRE_OF_MASS_M, urdf
from hil.plant.soil import SoilContacts
from hil.plant.stance import stance
from hil.plant.turns import inverse, middle, rotate
from hil.records import PlantState, Touch, WheelDrive, WheelTruth
from hil.terrain.field import Field
from onboard.config import Rover
from onboard.native import elementary
from onboard.records import F32, Pose
from protocol.conventions import TICK_NS, WHEELS

F64 = NDArray[np.float64]
I64 = NDArray[np.int64]

GRAVITY_MPS2 = 1.62
DRIVE_NM, DRIVE_SLEW_RADPS2 = 8.0, 1.0
STEER_NM, STEER_GAIN = 20.0, 0.2
FENCE_M, TIP_RAD, JUMP_M = 0.5, math.radians(35), 0.05
ROCK_LIMIT_M = 0.08  # a wheel on a rock of this height or more is a contact
HISTORY = 11  # poses of the last 100 ms, one a tick
STANDING_TICKS = 20
SETTLE_TICKS = 150
STEP_NS = 2_000_000  # of the physics; 5 ms is for campaigns


class PlantAbortError(RuntimeError):
    """The run is invalid from here on; the text has the reason."""


class Plant:
    """One rover on one field. `step_ns` is the physics step: 2 ms by default, 5 ms for campaigns; it divides 10 ms."""

    URDF_FLAGS = pybullet.URDF_USE_INERTIA_FROM_FILE | pybullet.URDF_USE_IMPLICIT_CYLINDER

    def __init__(
        self, field: Field, seed: int = 0, step_ns: int = STEP_NS, rover: Rover | None = None, soil: str = "nominal"
    ) -> None:
        if TICK_NS % step_ns:
            raise ValueError(f"a physics step of {step_ns} ns does not divide the tick of {TICK_NS} ns")
        self.field, self.rover, self.seed = field, rover or Rover(), seed
        self._step_ns, self._dt_s = step_ns, step_ns * 1e-9
        self._client = pybullet.connect(pybullet.DIRECT)
        self._engine()
        self.ground = Ground(field, self._client)
        self._load()
        self._soil = SoilContacts(
            field.grid, field.soil_z, self.rover.wheel_radius_m, self.rover.wheel_width_m, (soil,) * len(WHEELS)
        )
        self.soil = soil  # at the start; wheels and patches may have another
        self._limits_nm = [DRIVE_NM] * len(WHEELS)
        self._soils = [soil] * len(WHEELS)
        self.patches, self._shapes = Patches(), 0
        self._jammed = [False] * len(WHEELS)
        self._drives = (WheelDrive(0.0, 0.0),) * len(WHEELS)
        self.reset(field.start)

    def _engine(self) -> None:
        pybullet.setGravity(0, 0, -GRAVITY_MPS2, physicsClientId=self._client)
        pybullet.setPhysicsEngineParameter(
            fixedTimeStep=self._dt_s,
            numSolverIterations=50,
            numSubSteps=0,
            deterministicOverlappingPairs=1,
            enableFileCaching=0,
            physicsClientId=self._client,
        )

    def _load(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / "rover.urdf"
            path.write_text(urdf(self.rover))
            self._body = pybullet.loadURDF(str(path), flags=self.URDF_FLAGS, physicsClientId=self._client)
        count = pybullet.getNumJoints(self._body, physicsClientId=self._client)
        joints = {
            pybullet.getJointInfo(self._body, k, physicsClientId=self._client)[1].decode(): k for k in range(count)
        }
        self._wheels = [joints[f"wheel_{w}"] for w in WHEELS]
        self._steers = [joints[f"steer_{w}"] for w in WHEELS]
        self._rockers = [joints["rocker_left"], joints["rocker_right"]]
        for link in range(-1, count):
            wheel = link in self._wheels
            pybullet.setCollisionFilterGroupMask(
                self._body, link, WHEEL if wheel else BODY, ROCK if wheel else SOIL | ROCK, physicsClientId=self._client
            )
            pybullet.changeDynamics(
                self._body,
                link,
                linearDamping=0,
                angularDamping=0,
                jointDamping=0,
                restitution=0,
                lateralFriction=1.0,
                activationState=pybullet.ACTIVATION_STATE_DISABLE_SLEEPING,
                physicsClientId=self._client,
            )
        pybullet.setJointMotorControlArray(
            self._body, self._rockers, pybullet.VELOCITY_CONTROL, forces=[0, 0], physicsClientId=self._client
        )
        gear = pybullet.createConstraint(
            self._body,
            self._rockers[0],
            self._body,
            self._rockers[1],
            pybullet.JOINT_GEAR,
            [0, 1, 0],
            [0, 0, 0],
            [0, 0, 0],
            physicsClientId=self._client,
        )
        pybullet.changeConstraint(gear, gearRatio=1, erp=0.8, maxForce=1e4, physicsClientId=self._client)

    def reset(self, pose: Pose) -> PlantState:
        """Put the rover at x, y, yaw of `pose` on the ground, wheels straight and still, and let it settle.

        The time is 0 after settling. Raises PlantAbortError if the rover does not stand there on its four wheels.
        """
        at = stance(self.field, self.rover, pose)
        quaternion = pybullet.getQuaternionFromEuler([at.roll_rad, at.pitch_rad, pose.yaw_rad])
        up = rotate(quaternion, (0.0, 0.0, CENTRE_OF_MASS_M))
        place = [pose.x_m + up[0], pose.y_m + up[1], at.z_m + up[2]]
        pybullet.resetBasePositionAndOrientation(self._body, place, quaternion, physicsClientId=self._client)
        pybullet.resetBaseVelocity(self._body, [0, 0, 0], [0, 0, 0], physicsClientId=self._client)
        for joint in (*self._wheels, *self._steers):
            pybullet.resetJointState(self._body, joint, 0, 0, physicsClientId=self._client)
        for joint, rocker_rad in zip(self._rockers, (at.rocker_rad, -at.rocker_rad)):
            pybullet.resetJointState(self._body, joint, rocker_rad, 0, physicsClientId=self._client)
        self._soil.reset()
        self._drives = (WheelDrive(0.0, 0.0),) * len(WHEELS)
        self._rates, self._angles = [0.0] * len(WHEELS), [0.0] * len(WHEELS)
        self._history: deque[tuple[int, tuple[float, ...], tuple[float, ...]]] = deque(maxlen=HISTORY)
        self._now_ns, self._last = -SETTLE_TICKS * TICK_NS, None
        most_n = [0.0] * len(WHEELS)  # in the last ticks: a wheel that slides on a steep slope has no load at times
        for tick in range(SETTLE_TICKS):
            state = self.step()
            if tick >= SETTLE_TICKS - STANDING_TICKS:
                most_n = [max(most, wheel.load_n) for most, wheel in zip(most_n, state.wheels)]
        if min(most_n) <= 0:
            where = f"({pose.x_m:.2f}, {pose.y_m:.2f})"
            raise PlantAbortError(f"a wheel is in the air at {where}: does the rover stand in a rock?")
        return state

    def apply(self, drives: tuple[WheelDrive, ...]) -> None:
        """Set the targets of the four motor pairs from the next step on; the drivers' slew limits are in the plant."""
        self._drives = drives

    def set_motor(self, wheel: int, torque_nm: float) -> None:
        """Set the largest drive torque of wheel 1..4: 0 turns freely, a small value is weak, 8 is healthy."""
        self._limits_nm[wheel - 1] = torque_nm

    def jam(self, wheel: int, jammed: bool) -> None:
        """Block wheel 1..4 by its gear, or release it."""
        self._jammed[wheel - 1] = jammed

    def set_soil(self, wheel: int, name: str) -> None:
        """Set the soil under wheel 1..4, a row of hil.plant.soil.CLASSES."""
        self._soil.set_soil(wheel - 1, name)
        self._soils[wheel - 1] = name

    def reshape(self, soil_z: F32) -> None:
        """Set new ground heights, (rows, columns) on the field's grid: for wheels, body and scanner."""
        self._soil.reshape(soil_z)
        self.field = replace(self.field, soil_z=soil_z)
        self.ground.reshape(self.field)
        self._shapes += 1

    @property
    def ground_changes(self) -> int:
        """Number of changes of the ground: of its shape or its soil."""
        return self._shapes + self.patches.changes

    def step(self, ticks_ns: int = TICK_NS) -> PlantState:
        """Run one tick of physics and return the true state at its end. Raises PlantAbortError."""
        self._motors(ticks_ns * 1e-9)
        body, wheels, client, dt_s = self._body, self._wheels, self._client, self._dt_s
        states, forces, push, advance = (
            pybullet.getLinkStates,
            self._soil.step,
            pybullet.applyExternalForce,
            pybullet.stepSimulation,
        )
        contacts = []
        for _ in range(ticks_ns // self._step_ns):
            contacts = forces(states(body, wheels, computeLinkVelocity=1, physicsClientId=client), dt_s)
            for link, (force, point, load, _) in zip(wheels, contacts):
                if load > 0:
                    push(body, link, force, point, pybullet.WORLD_FRAME, client)  # lasts for one step
            advance(client)
        self._now_ns += ticks_ns
        if self.patches.laid:
            for k, soil in enumerate(self.patches.under(states(body, wheels, physicsClientId=client), self._soils)):
                self._soil.set_constants(k, soil)
        return self._truth(ticks_ns * 1e-9, contacts)

    def _motors(self, tick_s: float) -> None:
        slew, turn = DRIVE_SLEW_RADPS2 * tick_s, self.rover.steer_rate_radps * tick_s
        for k, drive in enumerate(self._drives):
            self._rates[k] += min(max(drive.rate_radps - self._rates[k], -slew), slew)
            if self._jammed[k]:
                self._rates[k] = 0.0
            self._angles[k] += min(max(drive.steer_rad - self._angles[k], -turn), turn)
        pybullet.setJointMotorControlArray(
            self._body,
            self._wheels,
            pybullet.VELOCITY_CONTROL,
            targetVelocities=self._rates,
            forces=self._limits_nm,
            physicsClientId=self._client,
        )
        pybullet.setJointMotorControlArray(
            self._body,
            self._steers,
            pybullet.POSITION_CONTROL,
            targetPositions=self._angles,
            forces=[STEER_NM] * len(WHEELS),
            positionGains=[STEER_GAIN] * len(WHEELS),
            physicsClientId=self._client,
        )

    def _truth(self, tick_s: float, contacts: list) -> PlantState:
        place, q = pybullet.getBasePositionAndOrientation(self._body, physicsClientId=self._client)
        velocity, spin = pybullet.getBaseVelocity(self._body, physicsClientId=self._client)
        arm = rotate(q, (0.0, 0.0, -CENTRE_OF_MASS_M))
        position = (place[0] + arm[0], place[1] + arm[1], place[2] + arm[2])
        moving = (
            velocity[0] + spin[1] * arm[2] - spin[2] * arm[1],
            velocity[1] + spin[2] * arm[0] - spin[0] * arm[2],
            velocity[2] + spin[0] * arm[1] - spin[1] * arm[0],
        )
        self._fence(position, q)
        before, self._last = self._last or (moving, q), (moving, q)
        felt = [(a - b) / tick_s for a, b in zip(moving, before[0])]
        half_way = middle(before[1], q)
        self._history.append((self._now_ns, position, q))
        joints = pybullet.getJointStates(
            self._body, [*self._wheels, *self._steers, *self._rockers], physicsClientId=self._client
        )
        return PlantState(
            now_ns=self._now_ns,
            position_m=np.array(position),
            quaternion_xyzw=np.array(q),
            velocity_mps=np.array(moving),
            angular_radps=np.array(rotate(inverse(q), spin)),
            specific_force_mps2=np.array(rotate(inverse(half_way), (felt[0], felt[1], felt[2] + GRAVITY_MPS2))),
            wheels=tuple(
                WheelTruth(*joints[k + 4][:1], *joints[k][:2], self._torque_nm(k, joints[k][3]), contacts[k][2])
                for k in range(4)
            ),
            touches=self._touches(),
            rockers_rad=(joints[8][0], joints[9][0]),
        )

    def _torque_nm(self, k: int, told_nm: float) -> float:
        """Limit a motor's torque: the engine repeats the last torque of a motor whose limit is 0."""
        return max(-self._limits_nm[k], min(self._limits_nm[k], told_nm))

    def _touches(self) -> tuple[Touch, ...]:
        """Contacts: wheels on rocks of ROCK_LIMIT_M or more, body on anything; each pair once."""
        found: dict[tuple[object, ...], Touch] = {}
        for contact in pybullet.getContactPoints(bodyA=self._body, physicsClientId=self._client):
            if contact[8] > 0:  # not yet in contact
                continue
            rock, (x_m, y_m, _) = self.ground.rock_at(contact[2], contact[6]), contact[6]
            wheel = self._wheels.index(contact[3]) + 1 if contact[3] in self._wheels else 0
            if wheel and (rock is None or rock.height_m < ROCK_LIMIT_M):
                continue
            height_m, rock_m = (rock.height_m, (rock.x_m, rock.y_m)) if rock else (0.0, None)
            found.setdefault((wheel, rock_m), Touch(wheel, height_m, rock_m, (x_m, y_m)))
        return tuple(sorted(found.values(), key=lambda touch: (touch.wheel, touch.rock_m or ())))

    def _fence(self, position: tuple[float, ...], q: tuple[float, ...]) -> None:
        x, y, z = position
        if not all(map(math.isfinite, (*position, *q))):
            raise PlantAbortError("the state is not a number")
        grid = self.field.grid
        edge = min(
            x - grid.x0_m,
            grid.x0_m + (grid.columns - 1) * grid.cell_m - x,
            y - grid.y0_m,
            grid.y0_m + (grid.rows - 1) * grid.cell_m - y,
        )
        if edge < FENCE_M:
            raise PlantAbortError(f"{edge:.2f} m from the field's edge at ({x:.2f}, {y:.2f})")
        qx, qy, qz, qw = q  # heights of the body's three axes
        up, ahead, left = 1 - 2 * (qx * qx + qy * qy), 2 * (qx * qz - qw * qy), 2 * (qy * qz + qw * qx)
        if up <= 0 or max(abs(ahead), abs(left)) > elementary.sin(TIP_RAD):
            raise PlantAbortError(f"tipped: pitch or roll over {math.degrees(TIP_RAD):.0f} deg at ({x:.2f}, {y:.2f})")
        if self._history and abs(z - self._history[-1][1][2]) > JUMP_M:
            before = self._history[-1][1][2]
            raise PlantAbortError(f"height jumped from {before:.3f} to {z:.3f} m at ({x:.2f}, {y:.2f})")

    def poses_at(self, times_ns: I64) -> tuple[F64, F64]:
        """base_link at times (n,) within the last 100 ms: positions (n, 3), quaternions x y z w (n, 4).

        Raises ValueError for other times.
        """
        known = np.array([row[0] for row in self._history], np.int64)
        if len(times_ns) and (times_ns.min() < known[0] or times_ns.max() > known[-1]):
            asked = f"{times_ns.min()} to {times_ns.max()}"
            raise ValueError(f"poses are known from {known[0]} to {known[-1]} ns, asked for {asked}")
        positions, turns = (np.array([row[k] for row in self._history]) for k in (1, 2))
        ahead = (turns[1:] * turns[:-1]).sum(axis=1) < 0  # q and -q are one orientation: take the short way
        turns[1:][np.logical_xor.accumulate(ahead)] *= -1.0
        columns = [np.interp(times_ns, known, column) for column in (*positions.T, *turns.T)]
        mixed = np.column_stack(columns[3:])
        return np.column_stack(columns[:3]), mixed / np.sqrt((mixed * mixed).sum(axis=1, keepdims=True))

    def cast(self, origins_m: F64, directions: F64, range_m: float) -> F64:
        """Ranges (n,) of rays on soil and rocks, inf where nothing is met (see hil.plant.ground_bodies.Ground.cast)."""
        return self.ground.cast(origins_m, directions, range_m)

    def close(self) -> None:
        """Free the engine."""
        pybullet.disconnect(self._client)
