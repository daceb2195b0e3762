"""The Lagrangian reference of the validation suite: Hertz's limit, its law, its energy and its convergence.

    test_lagrangian_contact.py CAIRN SCRATCH
"""

import importlib.util
import math
import sys

from harness import ROOT, SKIP

if importlib.util.find_spec("numpy") is None:
    print("Python lacks numpy")
    sys.exit(SKIP)

import numpy as np  # noqa: E402  after the check that it is there

sys.path.insert(0, str(ROOT / "scripts"))

from validation.closed_forms import HertzCylinder, HertzSphere, plane_strain_modulus  # noqa: E402
from validation.lagrangian_contact import POISSON, Pressed, at_approach, reference  # noqa: E402

MODULUS = plane_strain_modulus(1.0, POISSON)
FINE = {"elements": 32}


def law():
    """The stress is the derivative of the energy, and the tangent that of the stress; small strains give Hooke's law."""
    body = Pressed(True, 2, 2)

    def energy(strain: np.ndarray) -> np.ndarray:
        f = strain + np.array([1.0, 0, 0, 1, 1])
        J = (f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]) * f[:, 4]
        return (body.bulk / 2 * ((J**2 - 1) / 2 - np.log(J))
                + body.shear / 2 * (J ** (-2 / 3) * (f**2).sum(1) - 3))

    random = np.random.default_rng(1)
    strain, h = random.uniform(-0.2, 0.2, (20, 5)), 1e-6
    stress, tangent = body.law(strain)
    for k in range(5):
        step = h * np.eye(5)[k]
        slope = (energy(strain + step) - energy(strain - step)) / (2 * h)
        assert np.abs(slope - stress[:, k]).max() < 1e-8, k
        change = (body.law(strain + step)[0] - body.law(strain - step)[0]) / (2 * h)
        assert np.abs(change - tangent[:, :, k]).max() < 1e-7, k
    small = 1e-7 * np.array([[1.0, 0, 0, -POISSON, -POISSON]])  # uniaxial stress
    assert np.allclose(body.law(small)[0], [[1e-7, 0, 0, 0, 0]], atol=1e-13)


def hertz():
    """At a small approach the sphere is Hertz's, and so is the cylinder, whose approach has a logarithm."""
    sphere = HertzSphere(1.0, MODULUS)
    errors = []
    for state in reference(True, 0.01, 32, 6):
        across = state.approach >= 0.0025  # contacts of a few elements are steps
        errors.append(state.force / sphere.force(state.approach) - 1)
        if across:
            assert abs(state.width / sphere.contact_radius(state.force) - 1) < 0.02, state
            assert abs(state.peak / sphere.peak_pressure(state.force) - 1) < 0.05, state
    assert abs(errors[2]) < 0.02 and errors[2] < errors[3] < errors[5] < 0.06, errors
    cylinder = HertzCylinder(1.0, MODULUS)
    for state in reference(False, 0.02, 32, 6)[1:]:
        width = cylinder.half_width(state.force)
        approach = state.force / (math.pi * MODULUS) * (2 * math.log(4 / width) - 1)  # Johnson, eq. 4.57
        assert abs(state.approach / approach - 1) < 0.01, state
        assert abs(state.width / width - 1) < 0.04 and abs(state.peak / cylinder.peak_pressure(state.force) - 1) < 0.05


def work():
    """The plate's work is the energy of the sphere."""
    body = Pressed(True, 24, 24)
    depths = np.linspace(0.0, 0.06, 25)
    forces = [0.0] + [body.press(depth).force for depth in depths[1:]]
    energy = 0.0
    u = body.move.reshape(-1, 2)[body.nodes].reshape(len(body.nodes), 8)
    for to_strain, volume in zip(body.to_strain, body.volume):
        f = np.einsum("esn,en->es", to_strain, u) + np.array([1.0, 0, 0, 1, 1])
        J = (f[:, 0] * f[:, 3] - f[:, 1] * f[:, 2]) * f[:, 4]
        energy += (volume * (body.bulk / 2 * ((J**2 - 1) / 2 - np.log(J))
                             + body.shear / 2 * (J ** (-2 / 3) * (f**2).sum(1) - 3))).sum()
    done = np.trapz(forces, depths)
    assert abs(done / energy - 1) < 0.01, (done, energy)


def convergence():
    """Forces, widths and peaks change less and less with the elements, those between are interpolated."""
    for axial in (True, False):
        runs = {count: reference(axial, 0.06, count, 4)[1:] for count in (12, 24, 48)}
        for name, band in (("force", 0.006), ("width", 0.015), ("peak", 0.02)):
            change = [max(abs(getattr(a, name) / getattr(b, name) - 1) for a, b in zip(runs[n], runs[2 * n]))
                      for n in (12, 24)]
            assert change[1] < 0.7 * change[0] and change[1] < band, (axial, name, change)
        direct = Pressed(axial, 32, 32).press(0.029)
        between = at_approach(axial, 0.029, **FINE)
        assert abs(between.force / direct.force - 1) < 0.005 and abs(between.width / direct.width - 1) < 0.015


for test in (law, hertz, work, convergence):
    test()
    print(f"{test.__name__}: ok")
