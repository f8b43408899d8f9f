
/* A signal over POINTS values of ln a at one drive, and its variance. */
typedef struct {
    const learned_F *of;
    REAL y[@POINTS], variance[@POINTS];
} slice_F;

/* Weights of the nodes for ln u = x (barycentric, Chebyshev's nodes of the first kind). */
static void weights_F(const learned_F *l, REAL x, REAL *w)
{
    const REAL *node = numbers_F + l->nodes;
    REAL sum = 0;
    int i, k;
    for (k = 0; k < l->node_count; k++) {
        if (x == node[k]) {
            for (i = 0; i < l->node_count; i++) {
                w[i] = (i == k) ? 1 : 0;
            }
            return;
        }
        w[k] = numbers_F[l->nodes + l->node_count + k] / (x - node[k]);
        sum += w[k];
    }
    for (k = 0; k < l->node_count; k++) {
        w[k] /= sum;
    }
}

/* Place of ln a = x: the first of four points, and how far beyond it, in steps. */
static int place_F(const learned_F *l, REAL x, REAL *t)
{
    REAL s = (x - l->from) / l->step;
    int k;
    s = (s < 0) ? 0 : (s > @POINTS - 1) ? @POINTS - 1 : s;
    k = (int)s;
    k = (k < 1) ? 0 : (k > @POINTS - 3) ? @POINTS - 4 : k - 1;
    *t = s - (REAL)k;
    return k;
}

/* The cubic through four points, and its slope in ln a. */
static REAL cubic_F(const slice_F *s, const REAL *values, REAL x, REAL *slope)
{
    REAL t;
    const REAL *p = values + place_F(s->of, x, &t);
    REAL b = t - 1, c = t - 2, d = t - 3;
    *slope = (-(3 * t * t - 12 * t + 11) * p[0] + 3 * (3 * t * t - 10 * t + 6) * p[1] - 3 * (3 * t * t - 8 * t + 3) * p[2]
              + (3 * t * t - 6 * t + 2) * p[3]) / (6 * s->of->step);
    return (-b * c * d * p[0] + 3 * t * c * d * p[1] - 3 * t * b * d * p[2] + t * b * c * p[3]) / 6;
}

/* ln a between the points k and k + 1 where the signal is y (regula falsi, Illinois). */
static REAL crossing_F(const slice_F *s, REAL y, int k)
{
    REAL lo = s->of->from + s->of->step * (REAL)k, hi = s->of->from + s->of->step * (REAL)(k + 1);
    REAL f_lo = s->y[k] - y, f_hi = s->y[k + 1] - y, f, x, ignored;
    int i, side = 0;
    for (i = 0; i < 60; i++) {
        x = (lo * f_hi - hi * f_lo) / (f_hi - f_lo);
        f = cubic_F(s, s->y, x, &ignored) - y;
        if (f == 0 || fabs_F(hi - lo) < @SMALL || fabs_F(f) <= @SMALL * fabs_F(y)) {
            return x;
        }
        if ((f > 0) == (f_hi > 0)) {
            hi = x;
            f_hi = f;
            f_lo = (side == 1) ? f_lo / 2 : f_lo;
            side = 1;
        } else {
            lo = x;
            f_lo = f;
            f_hi = (side == -1) ? f_hi / 2 : f_hi;
            side = -1;
        }
    }
    return (lo + hi) / 2;
}

/* The point below which a share of the mass lies; within a cell the density goes straight. */
static REAL quantile_F(const REAL *p, REAL from, REAL step, REAL share)
{
    REAL total = 0, below = 0, cell, rise, left;
    int k;
    for (k = 0; k + 1 < @FINE; k++) {
        total += (p[k] + p[k + 1]) / 2;
    }
    for (k = 0; k + 1 < @FINE; k++) {
        cell = (p[k] + p[k + 1]) / 2;
        if (below + cell >= share * total) {
            rise = p[k + 1] - p[k];
            left = share * total - below;
            if (fabs_F(rise) < @TINY * (p[k] + p[k + 1])) {
                return from + step * ((REAL)k + left / p[k]);
            }
            left = p[k] * p[k] + 2 * rise * left;
            return from + step * ((REAL)k + (sqrt_F(left > 0 ? left : 0) - p[k]) / rise);
        }
        below += cell;
    }
    return NAN;
}

/* The distance by the posterior of ln a: flat within the calibrated distances, fading beyond. */
static int by_posterior_F(const side_F *side, REAL drive, REAL signal, found_F *found)
{
    const learned_F *l = learneds_F + side->first;
    slice_F s;
    REAL w[@NODES], flat[@FINE], faded[@FINE], y = signal - l->zero, u = drive + l->offset;
    REAL x = 0, sd = 0, lo, hi, from, to, step, off, t, slope, least = INFINITY;
    int i, k, peak = 0, far = -1, narrow = 0;
    s.of = l;
    weights_F(l, log_F(u), w);
    for (k = 0; k < @POINTS; k++) {
        s.y[k] = 0;
        s.variance[k] = 0;
        for (i = 0; i < l->node_count; i++) {
            s.y[k] += w[i] * numbers_F[l->values + i * @POINTS + k];
            s.variance[k] += w[i] * (REAL)learned_variances[l->variances + i * @POINTS + k];
        }
        s.y[k] *= u;
        s.variance[k] *= u * u;
        peak = (s.y[k] >= s.y[peak]) ? k : peak;
    }
    for (k = @POINTS - 2; k >= peak && far < 0; k--) {
        far = ((s.y[k] >= y) != (s.y[k + 1] >= y)) ? k : -1;
    }
    for (k = peak - 1; k >= 0 && found->near == 0; k--) {
        if ((s.y[k] >= y) != (s.y[k + 1] >= y)) {
            found->near = exp_F(crossing_F(&s, y, k));
        }
    }
    from = l->from + l->step * (REAL)(peak < @POINTS - 2 ? peak : @POINTS - 2);
    to = l->from + l->step * (@POINTS - 1);
    if (far >= 0) {
        x = crossing_F(&s, y, far);
        cubic_F(&s, s.y, x, &slope);
        t = cubic_F(&s, s.variance, x, &off);
        sd = sqrt_F(t > 0 ? t : 0) / fabs_F(slope);
        narrow = sd < @WIDE;
        if (narrow) {
            from = l->from + l->step * (REAL)peak;
            from = (x - 6 * sd > from) ? x - 6 * sd : from;
            to = (x + 6 * sd < to) ? x + 6 * sd : to;
        }
        if (narrow && from >= l->first && to <= l->last) {
            found->a = exp_F(x);
            found->sigma = found->a * sd;
            return VIBRISSA_OK;
        }
    }
    step = (to - from) / (@FINE - 1);
    for (k = 0; k < @FINE; k++) {
        t = from + step * (REAL)k;
        lo = cubic_F(&s, s.variance, t, &slope);
        lo = sqrt_F(lo > 0 ? lo : 0);
        hi = (cubic_F(&s, s.y, t, &slope) - y) / lo;
        least = (fabs_F(hi) < least) ? fabs_F(hi) : least;
        flat[k] = exp_F(t - hi * hi / 2) / lo;
        off = (l->first - t > t - l->last) ? l->first - t : t - l->last;
        off = (off > 0) ? off / l->fades : 0;
        faded[k] = flat[k] * exp_F(-off * off / 2);
    }
    if (far < 0 && least > @FAR) {
        return (s.y[@POINTS - 1] > y) ? side->if_weak : side->if_strong;
    }
    lo = quantile_F(faded, from, step, @LOW);
    hi = quantile_F(faded, from, step, @HIGH);
    t = quantile_F(faded, from, step, @HALF);
    if (narrow && hi > lo) {
        x += t - quantile_F(flat, from, step, @HALF);
        sd *= (hi - lo) / (quantile_F(flat, from, step, @HIGH) - quantile_F(flat, from, step, @LOW));
        found->a = exp_F(x);
        found->sigma = found->a * sd;
    } else {
        found->a = exp_F(t);
        found->sigma = (exp_F(hi) - exp_F(lo)) / 2;
    }
    return (isfinite(found->a) && isfinite(found->sigma)) ? VIBRISSA_OK : side->if_weak;
}
