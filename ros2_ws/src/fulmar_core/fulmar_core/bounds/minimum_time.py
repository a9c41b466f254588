"""Least time of a point mass through discs in order."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fulmar_core.bounds.chain import solve_chain
from fulmar_core.bounds.reach import log_barrier, reach_slack

WEIGHTS = (0.3, 0.06, 0.012, 0.0024, 0.0005)


@dataclass
class Course:
    """Discs in a row, in units in which the largest acceleration is 1; the last axis counts episodes."""

    start: np.ndarray  # (4, E)
    centres: np.ndarray  # (J, 2, E)
    radius: float
    top_speed: float
    pieces: int
    goals: np.ndarray  # (E,) how many discs

    def __post_init__(self):
        J, _, E = self.centres.shape
        self.links = J * self.pieces
        self.active = np.arange(self.links)[:, None] < self.goals * self.pieces
        self.disc = (np.arange(self.links) + 1) % self.pieces == 0

    def take(self, e):
        return Course(self.start[:, e], self.centres[:, :, e], self.radius, self.top_speed, self.pieces, self.goals[e])


def stop_and_go(c: Course):
    J, _, E = c.centres.shape
    x = np.zeros((c.links, 4, E))
    before = np.concatenate((c.start[None, :2], c.centres[:-1]))
    for i in range(c.pieces):
        x[i :: c.pieces, :2] = before + (c.centres - before) * ((i + 1) / c.pieces)
    last = np.concatenate((c.start[None], x[:-1]))
    step = np.linalg.norm(x[:, :2] - last[:, :2], axis=1)
    h = 2.2 * np.sqrt(step) + 0.1
    if np.isfinite(c.top_speed):
        h = np.maximum(h, 1.5 * step / c.top_speed)
    for _ in range(60):
        bad = ~inside(c, x, h)
        bad[1:] = False
        if not bad.any():
            break
        h[bad] *= 1.3
    return x, h


def pieces_of(c, x, h):
    before = np.concatenate((c.start[None], x[:-1]))
    dp, dv = x[:, :2] - before[:, :2], x[:, 2:] - before[:, 2:]
    mean = 0.5 * (x[:, 2:] + before[:, 2:])
    q = dp - h[:, None] * mean
    return dp.swapaxes(0, 1), dv.swapaxes(0, 1), mean.swapaxes(0, 1), q.swapaxes(0, 1)


def slacks(c, x, h):
    dp, dv, mean, q = pieces_of(c, x, h)
    room, s = reach_slack(dv, q, h)
    out = [room, s, h]
    off = x[c.disc, :2] - c.centres
    disc = np.full(h.shape, 1.0)
    disc[c.disc] = c.radius**2 - np.sum(off * off, axis=1)
    out.append(disc)
    if np.isfinite(c.top_speed):
        out.append(c.top_speed**2 - np.sum(x[:, 2:] ** 2, axis=1))
        out.append(c.top_speed**2 * h * h - np.sum(dp * dp, axis=0))
    return out


def inside(c, x, h):
    with np.errstate(invalid="ignore"):
        return np.logical_and.reduce([s > 0 for s in slacks(c, x, h)])


def merit(c, x, h, mu):
    out = slacks(c, x, h)
    ok = np.logical_and.reduce([s > 0 for s in out]) | ~c.active
    good = ok.all(axis=0)
    with np.errstate(invalid="ignore", divide="ignore"):
        logs = sum(np.log(s) for s in (out[1], *out[3:]))
    terms = np.where(c.active, h - mu * logs, 0.0)
    return np.where(good, terms.sum(axis=0), np.inf)


def newton(c, x, h, mu):
    links, E = h.shape
    dp, dv, mean, q = pieces_of(c, x, h)
    with np.errstate(all="ignore"):
        b = log_barrier(dv, q, h)
    g = np.where(c.active, mu * b.gradient, 0.0)
    H = np.where(c.active, mu * b.hessian, 0.0)
    act = c.active
    gv, gq, gh = g[0:2], g[2:4], g[4] + act
    A, C, Q = H[0:2, 0:2], H[0:2, 2:4], H[2:4, 2:4]
    kv, kq, hh = H[0:2, 4], H[2:4, 4], H[4, 4]
    half = 0.5 * h
    # chain to p, v, h
    Qm = Q[:, 0] * mean[0] + Q[:, 1] * mean[1]
    Cm = C[:, 0] * mean[0] + C[:, 1] * mean[1]
    gh = gh - np.sum(gq * mean, axis=0)
    HH = hh - 2 * np.sum(kq * mean, axis=0) + np.sum(Qm * mean, axis=0)
    cv, cq = kv - Cm, kq - Qm
    # gradient by (p0,v0,p1,v1)
    G0 = np.concatenate((-gq, -gv - half * gq))
    G1 = np.concatenate((gq, gv - half * gq))
    X0 = np.concatenate((-cq, -cv - half * cq - 0.5 * gq))
    X1 = np.concatenate((cq, cv - half * cq - 0.5 * gq))
    Ct = C.swapaxes(0, 1)
    sym = half * (C + Ct)
    hQ, hhQ = half * Q, half * half * Q
    B00, B01, B11 = (np.zeros((4, 4, links, E)) for _ in range(3))
    P = Q
    if np.isfinite(c.top_speed):
        V2 = c.top_speed**2
        u = V2 * h * h - np.sum(dp * dp, axis=0)
        m = np.where(act, mu, 0.0)
        u = np.where(act, u, 1.0)
        gp = 2 * m * dp / u
        G0[:2] -= gp
        G1[:2] += gp
        gh = gh - 2 * m * V2 * h / u
        P = Q + 4 * m * dp[:, None] * dp[None] / u**2
        for i in range(2):
            P[i, i] += 2 * m / u
        ph = -4 * m * V2 * h * dp / u**2
        X0[:2] -= ph
        X1[:2] += ph
        HH = HH + m * (4 * V2 * V2 * h * h / u**2 - 2 * V2 / u)
    B11[:2, :2] = P
    B00[:2, :2] = P
    B01[:2, :2] = -P
    pv1 = Ct - hQ  # [p1, v1]
    pv0 = -Ct - hQ  # [p1, v0]
    B11[:2, 2:] = pv1
    B11[2:, :2] = pv1.swapaxes(0, 1)
    B00[:2, 2:] = -pv0
    B00[2:, :2] = -pv0.swapaxes(0, 1)
    B01[:2, 2:] = -pv1  # [p0, v1]
    B01[2:, :2] = pv0.swapaxes(0, 1)  # [v0, p1]
    B11[2:, 2:] = A - sym + hhQ
    B00[2:, 2:] = A + sym + hhQ
    B01[2:, 2:] = -A + half * (C - Ct) + hhQ  # [v0, v1]
    # eliminate h
    HH = np.where(act, np.maximum(np.abs(HH), 1e-12), 1.0)
    r = 1.0 / HH
    G0 -= X0 * gh * r
    G1 -= X1 * gh * r
    B00 -= X0[:, None] * X0[None] * r
    B11 -= X1[:, None] * X1[None] * r
    B01 -= X0[:, None] * X1[None] * r
    diag = B11
    diag[:, :, :-1] += B00[:, :, 1:]
    grad = G1
    grad[:, :-1] += G0[:, 1:]
    # discs
    off = (x[c.disc, :2] - c.centres).swapaxes(0, 1)
    s = c.radius**2 - np.sum(off * off, axis=0)
    m = np.where(act[c.disc], mu, 0.0)
    grad[:2, c.disc] += 2 * m * off / s
    blockd = 4 * m * off[:, None] * off[None] / s**2
    for i in range(2):
        blockd[i, i] += 2 * m / s
    diag[:2, :2, c.disc] += blockd
    if np.isfinite(c.top_speed):
        v = x[:, 2:].swapaxes(0, 1)
        s = np.where(act, c.top_speed**2 - np.sum(v * v, axis=0), 1.0)
        m = np.where(act, mu, 0.0)
        grad[2:] += 2 * m * v / s
        diag[2:, 2:] += 4 * m * v[:, None] * v[None] / s**2
        for i in range(2):
            diag[2 + i, 2 + i] += 2 * m / s
    for i in range(4):
        diag[i, i] = np.where(act, diag[i, i], 1.0)
    dx = -solve_chain(
        np.ascontiguousarray(diag.transpose(2, 0, 1, 3)),
        np.ascontiguousarray(B01[:, :, 1:].transpose(2, 0, 1, 3)),
        np.ascontiguousarray(grad.transpose(1, 0, 2)),
    )
    d0 = np.concatenate((np.zeros((1, 4, E)), dx[:-1]))
    inner = gh + np.sum(X0.swapaxes(0, 1) * d0, axis=1) + np.sum(X1.swapaxes(0, 1) * dx, axis=1)
    dh = np.where(act, -inner * r, 0.0)
    # slope: full gradient . step ; reduced gradient . dx - gh^2/HH
    slope = np.sum(grad.swapaxes(0, 1) * dx, axis=(0, 1)) - np.sum(np.where(act, gh * gh * r, 0.0), axis=0)
    return dx, dh, slope


def solve(c: Course, x, h, weights=WEIGHTS, tol=0.3, maxit=200, log=False):
    E = h.shape[1]
    level = np.zeros(E, int)
    run = np.arange(E)
    w = np.asarray(weights)
    its = 0
    total = 0
    while run.size and its < maxit:
        its += 1
        total += run.size
        sub = c.take(run)
        mu = w[level[run]]
        xs, hs = x[:, :, run], h[:, run]
        dx, dh, slope = newton(sub, xs, hs, mu)
        f0 = merit(sub, xs, hs, mu)
        step = np.ones(run.size)
        todo = np.arange(run.size)
        for _ in range(40):
            xt, ht = xs[:, :, todo] + step[todo] * dx[:, :, todo], hs[:, todo] + step[todo] * dh[:, todo]
            f = merit(sub.take(todo), xt, ht, mu[todo])
            okk = f <= f0[todo] + 1e-4 * step[todo] * slope[todo]
            x[:, :, run[todo[okk]]] = xt[:, :, okk]
            h[:, run[todo[okk]]] = ht[:, okk]
            todo = todo[~okk]
            if not todo.size:
                break
            step[todo] *= 0.5
        stuck = np.zeros(run.size, bool)
        stuck[todo] = True
        done = (-slope < tol * mu) | stuck
        level[run[done]] += 1
        if log:
            print(its, run.size, level.mean(), step.mean(), stuck.sum(), h[:, 0].sum())
        run = run[level[run] < w.size]
    return x, h, total
