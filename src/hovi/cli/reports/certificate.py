"""The certificate of a plan, as text and as JSON."""

from __future__ import annotations

from typing import Any

import numpy as np

from hovi.cli.reports.accuracy import errors_json, errors_text
from hovi.flows.execution.dynamics_replay import DynamicsReplay
from hovi.planning.refinement.certificate import Certificate, Peak

NOT_OPTIMALITY = "this certifies dynamics and torques, not optimality"


def certificate_json(certificate: Certificate) -> dict[str, Any]:
    """All statements, null where missing, and the reasons for missing ones."""
    errors, energy = certificate.errors, certificate.hamiltonian
    return {
        "action": certificate.action,
        "integral": certificate.integral,
        "integral_error": certificate.integral_error,
        "bound": certificate.bound,
        "errors": None if errors is None else errors_json(errors),
        "hamiltonian": None if energy is None else energy.mean,
        "hamiltonian_spread": None if energy is None else energy.spread,
        "residual": certificate.residual,
        "torque": _peak_json(certificate.torque),
        "velocity": _peak_json(certificate.velocity),
        "replay": None if certificate.replay is None else _replay_json(certificate.replay),
        "missing": certificate.missing,
    }


def certificate_lines(certificate: Certificate, verbose: bool) -> list[tuple[str, str]]:
    """Labels and their text: one line of accuracy, or all statements if `verbose`."""
    if verbose:
        return _all_lines(certificate)
    return [("accuracy", f"{_errors(certificate)}; {_simulated(certificate)}")]


def _errors(certificate: Certificate) -> str:
    errors = certificate.errors
    if errors is None:
        return f"errors unknown ({certificate.missing['errors']})"
    parts = [f"cost {errors.cost:.0e}"]
    parts += [] if errors.sliding.all() else [f"joints {errors.angle:.0e} rad"]
    parts += [f"joints {1e3 * errors.slide:.0e} mm"] if errors.sliding.any() else []
    parts.append(f"{errors.frame} {1e3 * errors.largest_tip:.0e} mm")
    return f"estimated errors: {', '.join(parts)}"


def _simulated(certificate: Certificate) -> str:
    replay = certificate.replay
    if replay is None:
        return f"torques not simulated ({certificate.missing['replay']})"
    parts = [] if replay.sliding.all() else [f"{replay.angle:.0e} rad"]
    parts += [f"{1e3 * replay.slide:.0e} mm"] if replay.sliding.any() else []
    return f"simulating the torques from node to node agrees to {' and '.join(parts)}"


def _all_lines(certificate: Certificate) -> list[tuple[str, str]]:
    energy, missing = certificate.hamiltonian, certificate.missing
    lines = [
        ("errors", _text_or_reason(certificate.errors, errors_text, missing, "errors")),
        (
            "action",
            f"discrete {certificate.action:.10g}, integral along the curve "
            f"{certificate.integral:.10g}",
        ),
    ]
    if certificate.bound is not None:
        lines.append(("bound", f"this minimum costs at most {certificate.bound:.10g}"))
    if energy is not None:
        lines.append(("energy", f"Pontryagin's H = {energy.mean:.6g}, spread {energy.spread:.1e}"))
    if certificate.residual is not None:
        lines.append(("residual", f"{certificate.residual:.1e} of the momenta"))
    lines.append(
        ("largest", f"torque {_peak(certificate.torque)}; velocity {_peak(certificate.velocity)}")
    )
    lines.append(("replay", _text_or_reason(certificate.replay, _replay, missing, "replay")))
    return lines


def _text_or_reason(statement: Any, describe: Any, missing: dict[str, str], name: str) -> str:
    return f"none: {missing[name]}" if statement is None else str(describe(statement))


def _replay(replay: DynamicsReplay) -> str:
    deviations = []
    if not replay.sliding.all():
        deviations.append(f"{replay.angle:.1e} rad")
    if replay.sliding.any():
        deviations.append(f"{1e3 * replay.slide:.1e} mm")
    deviations.append(f"{replay.frame} by {1e3 * replay.largest_tip:.1e} mm")
    return (
        "odeint on ABA under the planned torques, started at every node, misses the next by "
        f"{', '.join(deviations)}: {NOT_OPTIMALITY}"
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


def _peak(peak: Peak | None) -> str:
    if peak is None:
        return "unknown"
    return f"{peak.value:.4g} at {peak.joint}, {peak.t:.3g} s"


def _peak_json(peak: Peak | None) -> dict[str, Any] | None:
    return None if peak is None else {"value": peak.value, "joint": peak.joint, "t": peak.t}
