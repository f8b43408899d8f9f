
/* ---- REAL ---- */

typedef struct {
    REAL from, to, scale;     /* drives; signal per drive to which the heads are relative */
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
/* Weights at x of values at n nodes (Lagrange). */
static void weights_F(const REAL *node, int n, REAL x, REAL *weight)
{
    int j, k;
    for (k = 0; k < n; k++) {
        weight[k] = 1;
        for (j = 0; j < n; j++) {
            weight[k] *= (j == k) ? 1 : (x - node[j]) / (node[k] - node[j]);
        }
    }
}

int vibrissa_locate_F(REAL drive, REAL signal, REAL zero, REAL *distance_mm, REAL *sigma_mm)
{
    const side_F *side;
    const strip_F *strip, *last;
    const REAL *from;
    const float *value;
    REAL node[@NODES], row[@NODES], point[@POINTS], head[@HEADS], size, x, s, slack, a = 0, sigma = 0;
    int i, k, n, first, part = 0, status = VIBRISSA_OK;
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
    weights_F(node, strip->rows, x, row);
    for (i = 0; i <= n; i++) {
        head[i] = 0;
        for (k = 0; k < strip->rows; k++) {
            head[i] += row[k] * heads_F[strip->heads + k * (n + 1) + i];
        }
    }
    /* The part of the row, and the place in it: 0 at its strongest signal, 1 at its weakest. */
    x = log_F(size / (drive * strip->scale));
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
    /* By a polynomial through the points around it. */
    first = (int)(s * (REAL)strip->cells) + 1 - @POINTS / 2;
    first = (first < 0) ? 0 : (first > strip->cells + 1 - @POINTS) ? strip->cells + 1 - @POINTS : first;
    for (i = 0; i < @POINTS; i++) {
        node[i] = (REAL)i;
    }
    weights_F(node, @POINTS, s * (REAL)strip->cells - (REAL)first, point);
    for (k = 0; k < strip->rows; k++) {
        value = vibrissa_table + strip->values + 2 * ((k * strip->parts + part) * (strip->cells + 1) + first);
        for (i = 0; i < @POINTS; i++) {
            a += row[k] * point[i] * value[2 * i];
            sigma += row[k] * point[i] * value[2 * i + 1];
        }
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
