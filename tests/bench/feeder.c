/* Feeding without the package: the equations of docs/model.md, "exact" flight and "signed" flips, for many parts, each
   thrown until it has met its fate.  Arrays and loops that the compiler vectorises; random numbers are hashed counters.
   Fates in the order of limitsets.cell.feeding.falling.FATES. */
#include <math.h>
#include <stdint.h>

enum { RIGHT, WRONG, WALL, EDGE, LEFT, NEVER };
enum { BATCH = 4096, MOST = 20000, MOST_SIDES = 16 };

typedef struct {
    double kappa, h, rho, arm, end, speed, landing; /* of the scatter: 0 where there is none */
    double a[MOST_SIDES], d[MOST_SIDES], length[MOST_SIDES], start[MOST_SIDES], clear[MOST_SIDES];
    int64_t sides, wanted, bounds, normal; /* `bounds` numbers in `clear`: ends of intervals */
} Feeder;

/* splitmix64 of a counter: a number above 0 and below 1 */
static inline double uniform(uint64_t seed, uint64_t number) {
    uint64_t z = seed + number * 0x9e3779b97f4a7c15u;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9u;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebu;
    return ((double)(int64_t)((z ^ (z >> 31)) >> 12) + 0.5) * 0x1p-52;
}

static void deviations(double scale, int64_t normal, uint64_t seed, uint64_t *number, int count, double *out) {
    uint64_t from = *number;
    if (scale == 0.0)
        for (int j = 0; j < count; j++) out[j] = 0.0;
    else if (normal)
        for (int j = 0; j < count; j++)
            out[j] = scale * sqrt(-2.0 * log(uniform(seed, from + 2 * j))) *
                     cos(6.283185307179586 * uniform(seed, from + 2 * j + 1));
    else
        for (int j = 0; j < count; j++) out[j] = scale * (2.0 * uniform(seed, from + j) - 1.0);
    *number = from + 2 * (uint64_t)count;
}

static double x[BATCH], a[BATCH], d[BATCH], kappa[BATCH], phi[BATCH], sine[BATCH], cosine[BATCH], noise[BATCH];
static int64_t on[BATCH];

static void turned(int count) {
    for (int j = 0; j < count; j++) sine[j] = sin(phi[j]);
    for (int j = 0; j < count; j++) cosine[j] = cos(phi[j]);
}

/* Newton's method from beyond the only root: kappa exceeds the distance of the struck corner in all these scenes */
static void landing_angles(int count) {
    for (int j = 0; j < count; j++)
        phi[j] = (x[j] + sqrt(x[j] * x[j] + 2.0 * kappa[j] * (a[j] + 2.0 * d[j]))) / kappa[j];
    for (int turn = 0; turn < 40; turn++) {
        double largest = 0.0;
        turned(count);
        for (int j = 0; j < count; j++) {
            double height = x[j] * phi[j] - a[j] * sine[j] + d[j] * (1.0 - cosine[j]) - 0.5 * kappa[j] * phi[j] * phi[j];
            double step = height / (x[j] - a[j] * cosine[j] + d[j] * sine[j] - kappa[j] * phi[j]);
            phi[j] -= step;
            largest = fmax(largest, fabs(step));
        }
        if (largest < 1e-7) break; /* the step after it is below 1e-13 */
    }
    turned(count);
}

/* fate of a part that the throw before left at rest, -1 of those that stay */
static int fate_at_rest(const Feeder *of, double at, int64_t side) {
    if (of->h > 0.0 && of->landing == 0.0 && at - of->a[side] < 1e-8 * of->a[side]) return NEVER; /* creeps */
    if (at <= of->a[side] || at > of->arm) return LEFT;
    if (at < of->end) return -1;
    if (side != of->wanted) return WRONG;
    for (int64_t k = 0; k < of->bounds; k += 2)
        if (at - of->end >= of->clear[k] && at - of->end <= of->clear[k + 1]) return RIGHT;
    return WALL;
}

static int is_at_edge(const Feeder *of, double at, int64_t side) {
    double acts = at + (of->rho * of->rho + of->d[side] * (of->h + of->d[side])) / at;
    return acts > of->end && at + of->length[side] - of->a[side] > of->end;
}

/* Parts by fate into `met`; returns all throws. */
double fates(const Feeder *of, int64_t parts, uint64_t seed, int64_t *met) {
    uint64_t number = 0;
    double total = 0.0, throws = 0.0;
    for (int64_t i = 0; i < of->sides; i++) total += fmax(of->end - of->start[i], 0.0);
    for (int64_t done = 0; done < parts; done += BATCH) {
        int count = parts - done < BATCH ? (int)(parts - done) : BATCH, kept = 0;
        for (int j = 0; j < count; j++) {
            double along = total * uniform(seed, number++);
            int64_t i = 0;
            for (; i < of->sides - 1 && along >= fmax(of->end - of->start[i], 0.0); i++)
                along -= fmax(of->end - of->start[i], 0.0);
            x[j] = of->start[i] + along, on[j] = i;
        }
        for (int turn = 0; turn < MOST && count; turn++) {
            kept = 0;
            for (int j = 0; j < count; j++) {
                if (is_at_edge(of, x[j], on[j]))
                    met[EDGE]++;
                else
                    x[kept] = x[j], on[kept++] = on[j];
            }
            throws += count;
            count = kept, kept = 0;
            deviations(of->speed, of->normal, seed, &number, count, noise);
            for (int j = 0; j < count; j++) {
                double quicker = 1.0 + noise[j];
                a[j] = of->a[on[j]], d[j] = of->d[on[j]], kappa[j] = of->kappa / (quicker * quicker);
            }
            landing_angles(count);
            deviations(of->landing, of->normal, seed, &number, count, noise);
            for (int j = 0; j < count; j++) {
                int64_t side = on[j];
                if (!(x[j] > a[j]) || !(phi[j] > 0.0) || phi[j] > 6.283185307179586) {
                    met[LEFT]++;
                    continue;
                }
                double right = a[j] * cosine[j] - d[j] * sine[j], above = a[j] * sine[j] + d[j] * cosine[j];
                double inertia = of->rho * of->rho + a[j] * a[j] + d[j] * d[j];
                double omega = (of->rho * of->rho + right * (x[j] - kappa[j] * phi[j]) + above * (of->h + d[j])) / inertia;
                double energy = 0.5 * inertia * omega * omega, barrier = kappa[j] * (hypot(a[j], d[j]) - above);
                double corner = x[j] - (of->h + d[j]) * phi[j] - right;
                int64_t next = side + 1 < of->sides ? side + 1 : 0;
                int flips = (omega > 0.0 ? energy : -energy) > (right > 0.0 ? barrier : -barrier);
                double at = flips ? corner - (of->length[next] - of->a[next]) : corner + a[j];
                side = flips ? next : side;
                int fate = fate_at_rest(of, at + noise[j], side);
                if (fate < 0)
                    x[kept] = at + noise[j], on[kept++] = side;
                else
                    met[fate]++;
            }
            count = kept;
        }
        met[NEVER] += count;
    }
    return throws;
}
