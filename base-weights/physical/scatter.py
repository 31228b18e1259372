"""Drops loose objects around and on the bodies on the table, simulated by Bullet (mm, z up)."""

import numpy as np
import pybullet as pb
from shapely.geometry import Point

from bodies import footprint

UNIT = 0.1  # Bullet's lengths are cm: its contact margins suit bodies of about one unit.


def scatter(rng, cam, fixed, pool, count, near):
    """Drops `count` objects of the pool, the first `near` of them near the fixed items; returns items (body, pose)."""
    client = pb.connect(pb.DIRECT)
    pb.setGravity(0, 0, -981, physicsClientId=client)
    pb.setTimeStep(1 / 400, physicsClientId=client)
    pb.setPhysicsEngineParameter(numSolverIterations=60, physicsClientId=client)
    try:
        pb.createMultiBody(0, pb.createCollisionShape(pb.GEOM_PLANE, physicsClientId=client), physicsClientId=client)
        for body, m in fixed:
            pb.createMultiBody(
                0, hull_shape(client, body.hull.vertices @ m[:3, :3].T + m[:3, 3]), physicsClientId=client
            )
        area = cam.table(30)
        things = []
        for i in range(count):
            body = pool[rng.integers(len(pool))]
            x, y = drop_place(rng, area, fixed if i < near else [])
            things.append((body, drop(rng, client, body, x, y, 4 + 3.2 * i)))
        for _ in range(1000 + 40 * count):
            pb.stepSimulation(physicsClientId=client)
        view = cam.table(-120)
        items = [(body, pose_of(client, body, handle)) for body, handle in things]
        return [(body, m) for body, m in items if footprint(body, m).centroid.within(view)]
    finally:
        pb.disconnect(client)


def hull_shape(client, vertices):
    return pb.createCollisionShape(pb.GEOM_MESH, vertices=(vertices * UNIT).tolist(), physicsClientId=client)


def drop_place(rng, area, fixed):
    """A place in the area, near one of the fixed items if there are any."""
    x0, y0, x1, y1 = area.bounds
    for _ in range(50):
        x, y = rng.uniform(x0, x1), rng.uniform(y0, y1)
        if fixed:
            body, m = fixed[rng.integers(len(fixed))]
            a, r = rng.uniform(0, 2 * np.pi), rng.uniform(0.25, 0.75) * np.hypot(*body.size[:2])
            x, y = m[0, 3] + r * np.cos(a), m[1, 3] + r * np.sin(a)
        if area.contains(Point(x, y)):
            break
    return x, y


def drop(rng, client, body, x, y, z):
    """Creates a falling body, usually nearly upright; returns Bullet's handle."""
    q = rng.standard_normal(4) * ([0.15, 0.15, 1, 1] if rng.random() < 0.7 else [1, 1, 1, 1])
    q /= np.linalg.norm(q)
    handle = pb.createMultiBody(
        0.02,
        hull_shape(client, body.hull.vertices - body.hull.center_mass),
        basePosition=[x * UNIT, y * UNIT, z],
        baseOrientation=q.tolist(),
        physicsClientId=client,
    )
    pb.changeDynamics(
        handle,
        -1,
        lateralFriction=0.7,
        rollingFriction=0.01,
        spinningFriction=0.01,
        restitution=0.05,
        linearDamping=0.1,
        angularDamping=0.4,
        physicsClientId=client,
    )
    return handle


def pose_of(client, body, handle):
    p, q = pb.getBasePositionAndOrientation(handle, physicsClientId=client)
    m = np.eye(4)
    m[:3, :3] = np.array(pb.getMatrixFromQuaternion(q)).reshape(3, 3)
    m[:3, 3] = np.array(p) / UNIT - m[:3, :3] @ body.hull.center_mass
    lowest = (body.hull.vertices @ m[:3, :3].T + m[:3, 3])[:, 2].min()
    m[2, 3] += max(0, 0.05 - lowest)
    return m
