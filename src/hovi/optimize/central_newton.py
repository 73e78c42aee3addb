"""Prototype."""
from __future__ import annotations
import numpy as np, os
from hovi.optimize.barrier import Barrier
from hovi.optimize.bounded_objective import BoundedOutcome, FEASIBILITY_TOLERANCE
from hovi.optimize.trust_region import Iteration, Stop
from hovi.system.deadline import raise_if_late
from hovi.system.interruption import raise_if_interrupted
import dataclasses

C0 = float(os.environ.get("C0", 10.0))
VERBOSE = bool(os.environ.get("VERB"))
MAXN = int(os.environ.get("MAXN", 15))
KEEP = float(os.environ.get("KEEP", 0))

def central(barrier, w_lower, w_upper, c, mu):
    """slack from w = z - c gap."""
    b = barrier.bounds
    root = np.sqrt(w_lower**2 + 4*c*mu); 
    gl = np.where(w_lower > 0, 2*mu/(w_lower+root+1e-300), (root - w_lower)/(2*c))
    root = np.sqrt(w_upper**2 + 4*c*mu); 
    gu = np.where(w_upper > 0, 2*mu/(w_upper+root+1e-300), (root - w_upper)/(2*c))
    use_lower = b.has_lower & (~b.has_upper | (w_lower >= w_upper))
    s = np.where(use_lower, b.lower + gl, np.where(b.has_upper, b.upper - gu, 0.0))
    return s

def with_slacks(barrier, s, mu):
    b = barrier.bounds
    below, above = np.maximum(s-b.lower,1e-16), np.maximum(b.upper-s,1e-16)
    zl = np.where(b.has_lower, mu/below, 0.0); zu = np.where(b.has_upper, mu/above, 0.0)
    return dataclasses.replace(barrier, s=s, zl=zl, zu=zu, mu=mu)

def newton(objective, x, options, report, start, density):
    outputs = objective.outputs(x)
    mu = options.barrier*density
    c = np.maximum(C0*density, 0)
    b0 = start
    c = C0*density
    wl = b0.zl - c*np.maximum(b0.s-b0.bounds.lower,0); wu = b0.zu - c*np.maximum(b0.bounds.upper-b0.s,0)
    barrier = with_slacks(b0, central(b0, wl, wu, c, mu), mu)
    outcome = BoundedOutcome(x, outputs, barrier, Stop.DIVERGED)
    scale = abs(outputs.value)
    while outcome.iterations < MAXN:
        raise_if_interrupted(); raise_if_late()
        barrier, outputs = outcome.barrier, outcome.outputs
        y = outputs.y
        sigma, rho, force = barrier.condensed(y)
        model = objective.model(outcome.x, sigma, rho, force)
        factor = model.factor(0.0)
        if factor is None:
            if VERBOSE: print("   indefinite")
            return outcome
        s, slope, norm2 = model.descend(factor)
        dy = objective.push(s, model)
        ds = dy + y - barrier.s
        b = barrier.bounds
        below, above = np.maximum(barrier.s-b.lower,1e-16), np.maximum(b.upper-barrier.s,1e-16)
        zl = np.where(b.has_lower, (mu - barrier.zl*ds)/below, 0.0)
        zu = np.where(b.has_upper, (mu + barrier.zu*ds)/above, 0.0)
        objective_x = objective.retract(outcome.x, s, model)
        new = objective.outputs(objective_x)
        objective.accept(s, model)
        ci = np.maximum(sigma, c)
        yy = new.y
        wl = zl - ci*(yy-b.lower); wu = zu - ci*(b.upper-yy)
        moved = with_slacks(barrier, central(barrier, wl, wu, ci, mu), mu)
        pred = 0.5*abs(slope)
        outcome.iterations += 1
        outcome.history.append(Iteration(new.value, pred, 1.0, 0.0, 0.0))
        outcome.x, outcome.outputs, outcome.barrier = objective_x, new, moved
        if VERBOSE: print(f"   pred {pred/scale:.1e} norm {norm2**.5:.1e} viol {outcome.violation.max():.1e} maxout {max((b.lower-yy).max(),(yy-b.upper).max()):.1e} n {len(yy)} nactive {(np.maximum(moved.zl,moved.zu)>1e-2*density).sum()} val {new.value:.9g}")
        if not np.isfinite(new.value): return outcome
        b=moved.bounds
        outside = max((b.lower-yy).max(),(yy-b.upper).max())
        miss = float((b.weights*np.maximum(moved.zl,moved.zu))@outcome.violation)
        if VERBOSE: print(f"      outside {outside:.1e} miss {miss/scale:.1e}")
        if pred <= options.enough*scale and miss<=options.enough*scale and outside<=1e-8:
            level = mu/density
            found = objective.refine(outcome.x, level)
            if found is None:
                outcome.stop = Stop.STATIONARY; outcome.barrier=dataclasses.replace(moved,s=np.clip(yy,b.lower+1e-16,b.upper-1e-16))
                outcome.marks.append((mu, outcome.x))
                sigma, rho, force = moved.condensed(new.y)
                outcome.model = objective.model(outcome.x, sigma, rho, force)
                return outcome
            new = objective.outputs(outcome.x)
            outcome.outputs = new
            outcome.barrier = moved.refined(objective.bounds, new.y, found.kept, found.origin)
            if VERBOSE: print("   refined", len(new.y))
    return outcome
