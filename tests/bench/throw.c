/* The throw of limitsets/feeder/thrower in C: the same arithmetic, the same check and codes, one state after the other in a
   loop the compiler vectorises (`images`), and what one would write without either (`images_libm`): sin and cos of
   libm, Newton until it stands still.  Keep it in step with limitsets/feeder/thrower; test_throws.py compares the answers.
   Flight exact, flip signed. */
#include <math.h>
#include <stdint.h>

typedef struct {
    double kappa, h, arm_length, a, d, ell, rho2, inertia, per_inertia, per_b, over, under, under2, a_next, shift;
    int64_t single_root, side, next;
} Side;

static const double w0 = 1.0 / 6, w1 = -1.0 / 120, w2 = 1.0 / 5040, w3 = -1.0 / 362880, w4 = 1.0 / 39916800,
                    w5 = -1.0 / 6227020800.0, w6 = 1.0 / 1307674368000.0, w7 = -1.0 / 355687428096000.0;
static const double v0 = 1.0 / 2, v1 = -1.0 / 24, v2 = 1.0 / 720, v3 = -1.0 / 40320, v4 = 1.0 / 3628800,
                    v5 = -1.0 / 479001600.0, v6 = 1.0 / 87178291200.0, v7 = -1.0 / 20922789888000.0;

typedef struct {
    double phi, s, v, w;
} Turned;

static inline Turned doubled(double phi, double s, double v, double w) {
    for (int i = 0; i < 3; i++) {
        double ww = 2.0 * (w + s * v), vv = 2.0 * s * s, ss = 2.0 * s * (1.0 - v);
        w = ww, v = vv, s = ss;
    }
    return (Turned){phi, s, v, w};
}

static inline Turned turn(double phi) {
    double t = 0.125 * phi, q = t * t, q2 = q * q, q4 = q2 * q2;
    double w = t * q * (((w0 + q * w1) + q2 * (w2 + q * w3)) + q4 * ((w4 + q * w5) + q2 * (w6 + q * w7)));
    double v = q * (((v0 + q * v1) + q2 * (v2 + q * v3)) + q4 * ((v4 + q * v5) + q2 * (v6 + q * v7)));
    return doubled(phi, t - w, v, w);
}

static inline Turned rough_turn(double phi) {
    double t = 0.125 * phi, q = t * t, w = t * q * (w0 + q * (w1 + q * w2)), v = q * (v0 + q * (v1 + q * v2));
    return doubled(phi, t - w, v, w);
}

static inline Turned turn_back(Turned to, double e) {
    double q = e * e, w = e * q * (w0 + q * (w1 + q * w2)), v = q * (v0 + q * (v1 + q * v2)), s = e - w;
    double c = 1.0 - to.v;
    return (Turned){to.phi - e, to.s - to.s * v - c * s, to.v + c * v - to.s * s, to.w - w - to.v * s + to.s * v};
}

static inline Turned turn_back_slightly(Turned to, double e) {
    double c = 1.0 - to.v, h = 0.5 * e;
    return (Turned){to.phi - e, to.s - e * (c + h * to.s), to.v - e * (to.s - h * c), to.w - e * (to.v - h * to.s)};
}

static inline double halley(const Side p, double reach, Turned at, double *slope_out) {
    double f = at.phi * (reach - 0.5 * p.kappa * at.phi) + p.a * at.w + p.d * at.v;
    double slope = reach + p.a * at.v + p.d * at.s - p.kappa * at.phi;
    double bend = p.a * at.s + p.d * (1.0 - at.v) - p.kappa;
    *slope_out = slope;
    return f * slope / (slope * slope - 0.5 * f * bend);
}

static inline double guess(const Side p, double reach) {
    double z = p.per_b * reach;
    return z * (1.0 + p.over * z) / (1.0 + z * (p.under + p.under2 * z));
}

/* s, v, w at the impact: the strike, the decision, the landing and the codes. */
static inline void finish(const Side p, double x, double phi, double s, double v, double w, int settled, double *after,
                          int64_t *side, int64_t *code_out) {
    double right = p.a * (1.0 - v) - p.d * s, above = p.a * s + p.d * (1.0 - v);
    double omega = (p.rho2 + right * (x - p.kappa * phi) + above * (p.h + p.d)) * p.per_inertia;
    double kinetic = 0.5 * p.inertia * omega * omega;
    double near = right * fabs(right) / (p.ell + fabs(above)), far = right > 0.0 ? p.ell - above : above - p.ell;
    double barrier = p.kappa * (above > 0.0 ? near : far);
    int flips = ((omega > 0.0 ? kinetic : -kinetic) - barrier) > 0.0;
    double shift = p.a * v - p.d * w - p.h * phi;
    shift = flips ? shift - p.shift : shift;
    double landed = x + shift;
    int64_t code = flips ? 1 : 0;
    code = landed <= (flips ? p.a_next : p.a) ? -1 : code;
    code = landed > p.arm_length ? -2 : code;
    code = settled ? code : -128;
    int model = (x > p.a) & (phi > 0.0) & (phi <= 6.283185307179586);
    code = (model | ((x > p.a) & !settled)) ? code : -3;
    int inside = code != -3;
    *after = inside ? landed : x;
    *side = inside ? (flips ? p.next : p.side) : p.side;
    *code_out = code;
}

void images(const Side *part, int64_t n, const double *restrict xs, double *restrict after, int64_t *restrict side,
            int64_t *restrict code) {
    const Side p = *part;
    for (int64_t k = 0; k < n; k++) {
        double x = xs[k], reach = x - p.a, slope;
        Turned at = rough_turn(guess(p, reach));
        at = turn(at.phi - halley(p, reach, at, &slope));
        double second = halley(p, reach, at, &slope);
        at = turn_back(at, second);
        double step = halley(p, reach, at, &slope);
        at = turn_back_slightly(at, step);
        int settled = (p.single_root != 0) & (fabs(second) <= 0x1p-4) & (fabs(step) <= 0x1p-18 * at.phi) & (slope < 0.0);
        finish(p, x, at.phi, at.s, at.v, at.w, settled, after + k, side + k, code + k);
    }
}

void images_libm(const Side *part, int64_t n, const double *restrict xs, double *restrict after,
                 int64_t *restrict side, int64_t *restrict code) {
    const Side p = *part;
    for (int64_t k = 0; k < n; k++) {
        double x = xs[k], reach = x - p.a, phi = guess(p, reach);
        int settled = 0;
        for (int i = 0; i < 50 && !settled; i++) {
            double s = sin(phi), c = cos(phi);
            double f = phi * (reach - 0.5 * p.kappa * phi) + p.a * (phi - s) + p.d * (1.0 - c);
            double step = f / (reach + p.a * (1.0 - c) + p.d * s - p.kappa * phi);
            phi -= step;
            settled = fabs(step) <= 1e-15 * phi;
        }
        double s = sin(phi), c = cos(phi);
        finish(p, x, phi, s, 1.0 - c, phi - s, 1, after + k, side + k, code + k);
    }
}
