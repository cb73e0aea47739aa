/* The throw of limitsets/thrower in C: the same arithmetic, the same check and codes, one state after the other in a
   loop the compiler vectorises (`images`), and what one would write without either (`images_libm`): sin and cos of
   libm, Newton until it stands still.  Keep it in step with limitsets/thrower; test_throws.py compares the answers.
   Flight exact, flip signed. */
#include <math.h>
#include <stdint.h>

typedef struct {
    double kappa, h, arm_length, a, d, ell, rho2, inertia, a_next, shift;
    int64_t single_root, side, next;
} Side;

static inline void turn(double phi, double *s_out, double *v_out, double *w_out) {
    const double w0 = 1.0 / 6, w1 = -1.0 / 120, w2 = 1.0 / 5040, w3 = -1.0 / 362880, w4 = 1.0 / 39916800,
                 w5 = -1.0 / 6227020800.0, w6 = 1.0 / 1307674368000.0, w7 = -1.0 / 355687428096000.0;
    const double v0 = 1.0 / 2, v1 = -1.0 / 24, v2 = 1.0 / 720, v3 = -1.0 / 40320, v4 = 1.0 / 3628800,
                 v5 = -1.0 / 479001600.0, v6 = 1.0 / 87178291200.0, v7 = -1.0 / 20922789888000.0;
    double t = 0.125 * phi, q = t * t;
    double w = t * q * (w0 + q * (w1 + q * (w2 + q * (w3 + q * (w4 + q * (w5 + q * (w6 + q * w7)))))));
    double v = q * (v0 + q * (v1 + q * (v2 + q * (v3 + q * (v4 + q * (v5 + q * (v6 + q * v7)))))));
    double s = t - w;
    for (int i = 0; i < 3; i++) {
        double ww = 2.0 * (w + s * v), vv = 2.0 * s * s, ss = 2.0 * s * (1.0 - v);
        w = ww, v = vv, s = ss;
    }
    *s_out = s, *v_out = v, *w_out = w;
}

static inline double guess(const Side p, double reach) {
    double b = 0.5 * (p.kappa - p.d), under = b * b - (2.0 / 3.0) * p.a * reach;
    double cubic = 2.0 * reach / (b + sqrt(under > 0.0 ? under : 0.0));
    double x = reach + p.a, far = (x + sqrt(x * x + 4.0 * p.kappa * p.ell)) / p.kappa;
    return under > 0.0 ? (cubic < far ? cubic : far) : far;
}

/* s, v, w at the impact: the strike, the decision, the landing and the codes. */
static inline void finish(const Side p, double x, double phi, double s, double v, double w, int settled, double *after,
                          int64_t *side, int64_t *code_out) {
    double right = p.a * (1.0 - v) - p.d * s, above = p.a * s + p.d * (1.0 - v);
    double omega = (p.rho2 + right * (x - p.kappa * phi) + above * (p.h + p.d)) / p.inertia;
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
        double x = xs[k], reach = x - p.a, phi = guess(p, reach), s, v, w, f, slope;
        for (int i = 0; i < 2; i++) { /* Halley */
            turn(phi, &s, &v, &w);
            f = phi * (reach - 0.5 * p.kappa * phi) + p.a * w + p.d * v;
            slope = reach + p.a * v + p.d * s - p.kappa * phi;
            double bend = p.a * s + p.d * (1.0 - v) - p.kappa;
            phi -= f * slope / (slope * slope - 0.5 * f * bend);
        }
        turn(phi, &s, &v, &w);
        f = phi * (reach - 0.5 * p.kappa * phi) + p.a * w + p.d * v;
        slope = reach + p.a * v + p.d * s - p.kappa * phi;
        double step = f / slope;
        phi -= step;
        int settled = (p.single_root != 0) & (fabs(step) <= 0x1p-28 * phi) & (slope < 0.0);
        turn(phi, &s, &v, &w);
        finish(p, x, phi, s, v, w, settled, after + k, side + k, code + k);
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
