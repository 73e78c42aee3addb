"""The certificate of a plan, for programs and for people."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.cli.reports.accuracy import errors_in_words, errors_json
from hovi.flows.dynamics_replay import DynamicsReplay
from hovi.planning.refinement.certificate import Certificate, Peak

NOT_OPTIMALITY = "this certifies dynamics and torques, not optimality"


COARSE = 0.01
"""Relative difference of two integrals beyond which a grid is too coarse to be believed."""
MEANINGLESS = 0.5
"""That beyond which the cost says nothing about the motion."""
ROUNDING = 1e-20
"""Difference of two integrals that rounding leaves, as of a robot that stays where it is."""


def certificate_json(certificate: Certificate) -> dict[str, Any]:
    """Every statement, null where it could not be made, and why it could not."""
    errors, energy = certificate.errors, certificate.hamiltonian
    return {
        "action": certificate.action,
        "integral": certificate.integral,
        "errors": None if errors is None else errors_json(errors),
        "hamiltonian": None if energy is None else energy.mean,
        "hamiltonian_spread": None if energy is None else energy.spread,
        "residual": certificate.residual,
        "torque": _peak_json(certificate.torque),
        "velocity": _peak_json(certificate.velocity),
        "replay": None if certificate.replay is None else _replay_json(certificate.replay),
        "missing": certificate.missing,
    }


def certificate_lines(certificate: Certificate) -> list[tuple[str, str]]:
    """Labels and sentences."""
    energy, missing = certificate.hamiltonian, certificate.missing
    lines = [
        ("errors", _or(certificate.errors, errors_in_words, missing, "errors")),
        (
            "action",
            f"discrete {certificate.action:.10g}, integral along the curve "
            f"{certificate.integral:.10g}",
        ),
    ]
    if COARSE < _gap(certificate) <= MEANINGLESS:
        lines.append(
            (
                "! coarse",
                "the two differ by more than 1 %: plan to a tolerance, or use more intervals",
            )
        )
    if energy is not None:
        lines.append(("energy", f"Pontryagin's H = {energy.mean:.6g}, spread {energy.spread:.1e}"))
    if certificate.residual is not None:
        lines.append(("residual", f"{certificate.residual:.1e} of the momenta"))
    lines.append(
        ("largest", f"torque {_peak(certificate.torque)}; velocity {_peak(certificate.velocity)}")
    )
    lines.append(("replay", _or(certificate.replay, _replay, missing, "replay")))
    return lines


def coarse_grid(certificate: Certificate | None) -> str:
    """That the cost of a plan means nothing on its grid; "" where it means something."""
    if certificate is None or _gap(certificate) <= MEANINGLESS:
        return ""
    return (
        f"the grid is too coarse for this motion: discrete action {certificate.action:.2g}, "
        f"integral {certificate.integral:.3g}; use more intervals or a tolerance"
    )


def _gap(certificate: Certificate) -> float:
    """The relative difference of the integral along the curve and the discrete action."""
    gap = abs(certificate.integral - certificate.action)
    return gap / max(abs(certificate.integral), ROUNDING) if gap > ROUNDING else 0.0


def _or(statement: Any, words: Any, missing: dict[str, str], name: str) -> str:
    return f"none: {missing[name]}" if statement is None else str(words(statement))


def _replay(replay: DynamicsReplay) -> str:
    misses = []
    if not replay.sliding.all():
        misses.append(f"{replay.angle:.1e} rad")
    if replay.sliding.any():
        misses.append(f"{1e3 * replay.slide:.1e} mm")
    misses.append(f"{replay.frame} by {1e3 * replay.largest_tip:.1e} mm")
    return (
        "DOP853 on ABA under the planned torques, started at every node, misses the next by "
        f"{', '.join(misses)}: {NOT_OPTIMALITY}"
    )


def _replay_json(replay: DynamicsReplay) -> dict[str, Any]:
    return {
        "q_rad": replay.angle,
        "q_m": replay.slide if replay.sliding.any() else None,
        "v": float(np.max(replay.v)),
        "tip_mm": 1e3 * replay.largest_tip,
        "frame": replay.frame,
        "certifies": NOT_OPTIMALITY.removeprefix("this certifies "),
    }


def _peak(peak: Peak) -> str:
    return f"{peak.value:.4g} at {peak.joint}, {peak.t:.3g} s"


def _peak_json(peak: Peak) -> dict[str, Any]:
    return {"value": peak.value, "joint": peak.joint, "t": peak.t}
