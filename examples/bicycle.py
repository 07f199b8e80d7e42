"""A bicycle nobody holds: falls over when slow, rides by itself at 4.3 to 6.0 m/s, leans over slowly when faster.

J. P. Meijaard, J. M. Papadopoulos, A. Ruina & A. L. Schwab, Linearized dynamics equations for the balance and steer of
a bicycle: a benchmark and review, Proc. R. Soc. A 463 (2007) 1955: x forward, y to the right, z down, thin wheels that
roll without slip. The run starts upright at 5 m/s with a push to the side; ``python bicycle.py`` draws the eigenvalues.
"""

import numpy as np

import mbd

model = mbd.Model("bicycle", gravity=(0.0, 0.0, 9.81))
road, axle, tilt = mbd.Plane(normal=(0, 0, -1)), (0, 1, 0), np.pi / 10
frame = mbd.RigidBody("frame", 85.0, (9.2, 11.0, 2.8, 0.0, 2.4, 0.0), center=(0.3, 0.0, -0.9))  # and the rider
fork = mbd.RigidBody("fork", 4.0, (0.05892, 0.06, 0.00708, 0.0, -0.00756, 0.0), center=(0.9, 0.0, -0.7))
rear = mbd.RigidBody("rear wheel", 2.0, (0.0603, 0.12, 0.0603))
front = mbd.RigidBody("front wheel", 3.0, (0.1405, 0.28, 0.1405))
head = [body.point(1.1, 0.0, 0.0, name="head") for body in (frame, fork)]  # 80 mm of trail ahead of the front wheel
model.connect(mbd.Free("ride", model.ground.origin, frame.origin))
model.connect(mbd.Revolute("steer", *head, axis=(np.sin(tilt), 0.0, np.cos(tilt))))
for wheel, hub, radius in (rear, frame.point(0.0, 0.0, -0.3), 0.3), (front, fork.point(1.02, 0.0, -0.35), 0.35):
    model.connect(mbd.Revolute(f"{wheel.name} hub", hub, wheel.origin, axis=axle))
    model.constrain(mbd.Bilateral(f"{wheel.name} height", mbd.disk_touchdown(wheel.origin, radius, axle, road)))
    model.constrain(mbd.Rolling(f"{wheel.name} tyre", wheel.origin, radius, road, axis=axle))


def riding(speed, lean_rate=0.0):
    """Straight ahead at a speed [m/s]."""
    rates = {"rear wheel hub.angle": -speed / 0.3, "front wheel hub.angle": -speed / 0.35}
    return mbd.assemble(model, velocity={"ride.x": speed, "ride.angular_velocity.x": lean_rate, **rates})


def motions(speed):
    """The four eigenvalues of lean and steer [1/s]; six others are zero: no place, heading or speed matters."""
    return np.roots(np.poly(mbd.linearize(model, riding(speed)).A)[:5])


start, integrator, dt, until = riding(5.0, lean_rate=0.5), mbd.GeneralizedAlpha(rho_inf=0.9), 2e-3, 4.0
if __name__ == "__main__":
    import matplotlib.pyplot as plt

    speeds = np.linspace(0.0, 10.0, 201)
    plt.plot(speeds, [motions(speed).real for speed in speeds], "k.", markersize=2)
    plt.gca().set(xlabel="speed [m/s]", ylabel="real parts [1/s]", ylim=(-10, 10), title="weave 4.29, capsize 6.02 m/s")
    plt.savefig("bicycle.svg")
