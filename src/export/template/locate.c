
/* ---- REAL ---- */

typedef struct {
    REAL from, to;            /* drives */
    int rows, parts, cells;   /* rows: at the Chebyshev-Lobatto points of ln drive; parts of a row, cells of a part */
    int heads, values;        /* where they begin */
} strip_F;

typedef struct {
    int first, count;                  /* strips */
    REAL nearest, farthest, rounding;  /* calibrated distances, mm */
    REAL limit, end_stop;              /* |signal| of the strain limit and of the sensor's end stop */
    int if_strong, if_weak;            /* what is said of signals beyond the table */
} side_F;

@TABLES
/* The cubic through every second of p at t = 0, 1, 2, 3. */
static REAL cubic_F(const float *p, REAL t)
{
    REAL b = t - 1, c = t - 2, d = t - 3;
    return (3 * t * d * (c * p[2] - b * p[4]) + b * c * (t * p[6] - d * p[0])) / 6;
}

int vibrissa_locate_F(REAL drive, REAL signal, REAL zero, REAL *distance_mm, REAL *sigma_mm)
{
    const side_F *side;
    const strip_F *strip, *last;
    const REAL *from;
    REAL node[@ROWS], weight[@ROWS], head[@HEADS], size, x, s, t, slack, a = 0, sigma = 0;
    int i, j, k, n, part = 0, status = VIBRISSA_OK;
    *distance_mm = NAN;
    *sigma_mm = NAN;
@PREPARE
    if (!isfinite(drive) || !isfinite(signal)) {
        return VIBRISSA_BAD_INPUT;
    }
    if (signal == 0) {
        return VIBRISSA_NO_STRAIN;
    }
    size = fabs_F(signal);
    side = sides_F + (signal > 0);
    if (size > side->limit) {
        status = VIBRISSA_STRAIN_LIMIT;
    }
    strip = strips_F + side->first;
    last = strip + (side->count > 0 ? side->count - 1 : 0);
    if (side->count == 0 || drive < strip->from * (1 - @SAME) || drive > last->to * (1 + @SAME)) {
        return status | VIBRISSA_OUTSIDE_CALIBRATION;
    }
    if (size >= side->end_stop) {
        return status | VIBRISSA_STRAIN_LIMIT;
    }
    while (strip < last && drive > strip->to) {
        strip++;
    }
    /* Weights of the rows at this drive (Lagrange), and what stands at their heads. */
    n = 3 * strip->parts;
    x = (strip->rows > 1) ? 2 * log_F(drive / strip->from) / log_F(strip->to / strip->from) - 1 : 0;
    for (k = 0; k < strip->rows; k++) {
        node[k] = (strip->rows > 1) ? -cos_F(@PI * (REAL)k / (REAL)(strip->rows - 1)) : 0;
    }
    for (i = 0; i <= n; i++) {
        head[i] = 0;
    }
    for (k = 0; k < strip->rows; k++) {
        weight[k] = 1;
        for (j = 0; j < strip->rows; j++) {
            weight[k] *= (j == k) ? 1 : (x - node[j]) / (node[k] - node[j]);
        }
        from = heads_F + strip->heads + k * (n + 1);
        for (i = 0; i <= n; i++) {
            head[i] += weight[k] * from[i];
        }
    }
    /* The part of the row, and the place in it: 0 at its strongest signal, 1 at its weakest. */
    x = log_F(size / drive);
    if (x > head[0] || x < head[n]) {
        return status | (x > head[0] ? side->if_strong : side->if_weak);
    }
    while (3 * part + 3 < n && x < head[3 * part + 3]) {
        part++;
    }
    from = head + 3 * part;
    s = (from[0] > from[3]) ? sqrt_F((from[0] - x) / (from[0] - from[3])) : 0;
    s = (s > @FIRST) ? s : @FIRST;
    s = (s < 1) ? s : 1;
    if (s >= from[1] && s <= from[2]) {
        status |= VIBRISSA_AMBIGUOUS;
    }
    k = (int)(s * (REAL)strip->cells);
    k = (k < 1) ? 0 : (k > strip->cells - 2) ? strip->cells - 3 : k - 1;
    t = s * (REAL)strip->cells - (REAL)k;
    for (j = 0; j < strip->rows; j++) {
        i = strip->values + 2 * ((j * strip->parts + part) * (strip->cells + 1) + k);
        a += weight[j] * cubic_F(table + i, t);
        sigma += weight[j] * cubic_F(table + i + 1, t);
    }
    sigma /= s;
    slack = @BEYOND * sigma;
    if (slack > (side->farthest - side->nearest) / 2) {
        slack = (side->farthest - side->nearest) / 2;
    }
    slack += side->rounding;
    if (a < side->nearest - slack || a > side->farthest + slack) {
        status |= VIBRISSA_OUTSIDE_CALIBRATION;
    }
    *distance_mm = a;
    *sigma_mm = sigma;
    return status;
}
