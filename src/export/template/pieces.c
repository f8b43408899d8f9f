
/* Sum of c[k] T_k(y) (Clenshaw), and its slope. */
static REAL series_F(const REAL *c, int n, REAL y, REAL *slope)
{
    REAL b = 0, b1 = 0, b2 = 0, d = 0, d1 = 0, d2 = 0;
    int k;
    for (k = n - 1; k > 0; k--) {
        b = 2 * y * b1 - b2 + c[k];
        d = 2 * b1 + 2 * y * d1 - d2;
        b2 = b1;
        b1 = b;
        d2 = d1;
        d1 = d;
    }
    *slope = b1 + y * d1 - d2;
    return c[0] + y * b1 - b2;
}

/* Where the series is `target`, between lo and hi. */
static REAL root_F(const REAL *c, int n, REAL target, REAL lo, REAL hi)
{
    REAL slope, e, step, y = (lo + hi) / 2;
    int i, rising = series_F(c, n, hi, &slope) > target;
    for (i = 0; i < 80; i++) {
        e = series_F(c, n, y, &slope) - target;
        if ((e > 0) == rising) {
            hi = y;
        } else {
            lo = y;
        }
        step = e / slope;
        if (fabs_F(step) <= @SMALL || hi - lo <= @SMALL) {
            break;
        }
        y = (y - step > lo && y - step < hi) ? y - step : (lo + hi) / 2;
    }
    return y;
}

/* Where the slope vanishes, between lo, where the series rises, and hi, where it falls. */
static REAL peak_F(const REAL *c, int n, REAL lo, REAL hi)
{
    REAL slope, y = (lo + hi) / 2;
    int i;
    for (i = 0; i < 60 && hi - lo > @SMALL; i++) {
        series_F(c, n, y, &slope);
        if (slope > 0) {
            lo = y;
        } else {
            hi = y;
        }
        y = (lo + hi) / 2;
    }
    return y;
}

/* Keeps a root at y; how many there are then. */
static int keep_F(const piece_F *p, const REAL *c, REAL z, REAL y, int n, found_F *found)
{
    REAL slope, ignored, v[@ROWS];
    REAL a = p->a * exp_F(p->half * y);
    int i;
    if (n == 1) {
        found->near = a;
    } else if (n == 0) {
        found->a = a;
        series_F(c, p->rows, y, &slope);
        slope /= p->half * a;
        found->of_signal = 1 / (slope * slope);
        for (i = 0; i < p->variance_rows; i++) {
            v[i] = series_F(numbers_F + p->variance + i * p->variance_columns, p->variance_columns, z, &ignored);
        }
        found->variance = series_F(v, p->variance_rows, y, &ignored);
        found->near = (slope > 0) ? -a : 0;
    }
    return n + 1;
}

/* The farthest distance with this signal, and the next one. */
static int by_pieces_F(const side_F *side, REAL drive, REAL signal, found_F *found)
{
    const strip_F *strip = strips_F + side->first;
    const strip_F *last = strip + side->count - 1;
    REAL c[@ROWS], ignored, z = 0, target, y0, y1, e0, e1, d0, d1, top, over = 0;
    int i, j, k, n = 0, below = 0, weak = 0;
    while (strip < last && drive >= strip[1].from) {
        strip++;
    }
    if (strip->to > strip->from) {
        z = (2 * drive - (strip->to + strip->from)) / (strip->to - strip->from);
        z = (z < -1) ? -1 : (z > 1) ? 1 : z;
    }
    for (i = 0; i < strip->count && n < 2; i++) {
        const piece_F *p = pieces_F + strip->first + i;
        target = log_F(signal / (drive * p->scale));
        for (j = 0; j < p->rows; j++) {
            c[j] = series_F(numbers_F + p->value + j * p->columns, p->columns, z, &ignored);
        }
        y0 = 1;
        e0 = series_F(c, p->rows, y0, &d0) - target;
        if (i == 0) {
            below = e0 <= 0;
            weak = !below;
            over = e0;
            if (weak && side->cut) {
                return side->if_weak;
            }
        }
        for (k = 1; k <= p->looks && n < 2; k++) {
            y1 = 1 - 2 * (REAL)k / p->looks;
            e1 = series_F(c, p->rows, y1, &d1) - target;
            if (below != (e1 <= 0)) {
                /* Where rounding puts the end of one piece on another side than the next one's, the root is there. */
                n = keep_F(p, c, z, below == (e0 <= 0) ? root_F(c, p->rows, target, y1, y0) : y0, n, found);
                below = e1 <= 0;
            } else if (below && e0 < 0 && d0 < 0 && d1 > 0) {
                top = peak_F(c, p->rows, y1, y0);
                if (series_F(c, p->rows, top, &ignored) >= target) {
                    n = keep_F(p, c, z, root_F(c, p->rows, target, top, y0), n, found);
                    n = keep_F(p, c, z, root_F(c, p->rows, target, y1, top), n, found);
                }
            }
            y0 = y1;
            e0 = e1;
            d0 = d1;
        }
    }
    if (n == 0) {
        return weak ? side->if_weak : side->if_strong;
    }
    if (found->near < 0) {
        found->near = (weak && over >= side->alone) ? 0 : -found->near;
    }
    return VIBRISSA_OK;
}
