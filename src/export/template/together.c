
/* ---- REAL ---- */

/* A channel on one side: the sign of its signal, and where its tables are. */
typedef struct {
    int sign, gauge;                  /* sign of the signal; side of the whisker that it stands for, -1 where that is not known */
    int value, variance;              /* numbers: a Chebyshev series of signal/drive over ln a and the drive; its variance on a grid */
    REAL ln_a[2], drives[2];          /* where they hold; calibrated drives from their origin */
    REAL nearest, farthest, rounding; /* calibrated distances, mm */
    REAL interest[2], limit;          /* distances within which a second one is ambiguous; |signal| of the strain limit */
} side_F;

typedef struct {
    int first, count;                /* its sides */
    REAL origin, zero, per, bridge;  /* drive that counts as 0; unit of the signal; factor of a quarter bridge, or 0 */
} channel_F;

@TABLES

/* A tap: channels that are used, on the side of their signals; the factor of the covariance of their noise. */
typedef struct {
    int n, unknowns;
    const side_F *side[@CHANNELS];
    REAL origin[@CHANNELS], signal[@CHANNELS], factor[@CHANNELS][@CHANNELS], drive, lo[2], hi[2];
} tap_F;

/* T_0(x) ... T_{n-1}(x) and their slopes. */
static void basis_F(int n, REAL x, REAL *t, REAL *d)
{
    int k;
    for (k = 0; k < n; k++) {
        t[k] = (k == 0) ? 1 : (k == 1) ? x : 2 * x * t[k - 1] - t[k - 2];
        d[k] = (k == 0) ? 0 : (k == 1) ? 1 : 2 * t[k - 1] + 2 * x * d[k - 1] - d[k - 2];
    }
}

static REAL place_F(const REAL *ends, REAL x)
{
    return (ends[1] > ends[0]) ? (2 * x - ends[0] - ends[1]) / (ends[1] - ends[0]) : 0;
}

/* Signal that is expected of a tap at a by the drive u from its origin, and its slopes. */
static REAL expected_F(const side_F *s, REAL a, REAL u, REAL *by)
{
    REAL t[@ROWS], dt[@ROWS], p[@COLUMNS], dp[@COLUMNS], v = 0, v_a = 0, v_u = 0, row, slope;
    const REAL *c = numbers_F + s->value;
    int i, j;
    basis_F(@ROWS, place_F(s->ln_a, log_F(a)), t, dt);
    basis_F(@COLUMNS, place_F(s->drives, u), p, dp);
    for (i = 0; i < @ROWS; i++) {
        row = 0;
        slope = 0;
        for (j = 0; j < @COLUMNS; j++) {
            row += *c * p[j];
            slope += *c++ * dp[j];
        }
        v += row * t[i];
        v_a += row * dt[i];
        v_u += slope * t[i];
    }
    by[0] = u * v_a * 2 / ((s->ln_a[1] - s->ln_a[0]) * a);
    by[1] = v + ((s->drives[1] > s->drives[0]) ? u * v_u * 2 / (s->drives[1] - s->drives[0]) : 0);
    return u * v;
}

/* Variance of what is expected there. */
static REAL left_F(const side_F *s, REAL a, REAL u)
{
    REAL x = (place_F(s->ln_a, log_F(a)) + 1) / 2 * (@GRID_A - 1), y = (place_F(s->drives, u) + 1) / 2 * (@GRID_U - 1);
    const REAL *v;
    int i, j;
    x = (x < 0) ? 0 : (x > @GRID_A - 1) ? @GRID_A - 1 : x;
    y = (y < 0) ? 0 : (y > @GRID_U - 1) ? @GRID_U - 1 : y;
    i = (x < @GRID_A - 2) ? (int)x : @GRID_A - 2;
    j = (y < @GRID_U - 2) ? (int)y : @GRID_U - 2;
    x -= (REAL)i;
    y -= (REAL)j;
    v = numbers_F + s->variance + i * @GRID_U + j;
    return (1 - x) * ((1 - y) * v[0] + y * v[1]) + x * ((1 - y) * v[@GRID_U] + y * v[@GRID_U + 1]);
}

/* Factors the covariance of noise (Cholesky); whether it is one. */
static int factor_F(tap_F *t, REAL noise[@CHANNELS][@CHANNELS])
{
    REAL sum;
    int i, j, k;
    for (i = 0; i < t->n; i++) {
        for (j = 0; j <= i; j++) {
            sum = noise[i][j] * ((i == j) ? 1 + @RIDGE : 1);
            for (k = 0; k < j; k++) {
                sum -= t->factor[i][k] * t->factor[j][k];
            }
            if (i == j && !(sum > 0)) {
                return 0;
            }
            t->factor[i][j] = (i == j) ? sqrt_F(sum) : sum / t->factor[j][j];
        }
    }
    return 1;
}

/* Sum of the squares of residuals at x (distance, drive), each over its standard deviation, with the normal matrix and gradient. */
static REAL misfit_F(const tap_F *t, const REAL *x, REAL normal[2][2], REAL *gradient)
{
    REAL r[@CHANNELS], by[@CHANNELS][2], sum = 0, u = (t->unknowns == 2) ? x[1] : t->drive;
    int i, k, m, n;
    for (m = 0; m < 2; m++) {
        gradient[m] = normal[m][0] = normal[m][1] = 0;
    }
    for (i = 0; i < t->n; i++) {
        r[i] = expected_F(t->side[i], x[0], u - t->origin[i], by[i]) - t->signal[i];
        for (k = 0; k < i; k++) {
            r[i] -= t->factor[i][k] * r[k];
            by[i][0] -= t->factor[i][k] * by[k][0];
            by[i][1] -= t->factor[i][k] * by[k][1];
        }
        r[i] /= t->factor[i][i];
        by[i][0] /= t->factor[i][i];
        by[i][1] /= t->factor[i][i];
        sum += r[i] * r[i];
        for (m = 0; m < t->unknowns; m++) {
            gradient[m] += by[i][m] * r[i];
            for (n = 0; n < t->unknowns; n++) {
                normal[m][n] += by[i][m] * by[i][n];
            }
        }
    }
    return sum;
}

/* Variance of the distance by the normal matrix; 0 where there is none. */
static REAL spread_F(const tap_F *t, REAL normal[2][2])
{
    REAL det;
    if (t->unknowns == 1) {
        return (normal[0][0] > 0) ? 1 / normal[0][0] : 0;
    }
    det = normal[0][0] * normal[1][1] - normal[0][1] * normal[1][0];
    return (det > @TINY * normal[0][0] * normal[1][1]) ? normal[1][1] / det : 0;
}

/* Goes from x to a least misfit (Levenberg, Marquardt), which it gives with the variance of the distance; infinite at the ends of what is looked at. */
static REAL settle_F(const tap_F *t, REAL *x, REAL *variance)
{
    REAL normal[2][2], gradient[2], next[2], normal_2[2][2], gradient_2[2], step[2] = {0, 0};
    REAL chi = misfit_F(t, x, normal, gradient), chi_2, damping = (REAL)1e-3, det, p, q;
    int k, m, moved;
    for (k = 0; k < 100; k++) {
        p = normal[0][0] * (1 + damping);
        step[1] = 0;
        /* A drive that is pushed beyond an end stays there. */
        if (t->unknowns == 1 || (x[1] <= t->lo[1] && gradient[1] > 0) || (x[1] >= t->hi[1] && gradient[1] < 0)) {
            step[0] = gradient[0] / p;
        } else {
            q = normal[1][1] * (1 + damping);
            det = p * q - normal[0][1] * normal[1][0];
            step[0] = (q * gradient[0] - normal[0][1] * gradient[1]) / det;
            step[1] = (p * gradient[1] - normal[1][0] * gradient[0]) / det;
        }
        moved = 0;
        for (m = 0; m < t->unknowns; m++) {
            next[m] = x[m] - step[m];
            next[m] = (next[m] > t->lo[m]) ? next[m] : t->lo[m];
            next[m] = (next[m] < t->hi[m]) ? next[m] : t->hi[m];
            moved = moved || fabs_F(next[m] - x[m]) > @SETTLED * fabs_F(x[m]);
        }
        if (!moved) {
            break;
        }
        chi_2 = misfit_F(t, next, normal_2, gradient_2);
        if (chi_2 <= chi) {
            for (m = 0; m < 2; m++) {
                x[m] = (m < t->unknowns) ? next[m] : x[m];
                gradient[m] = gradient_2[m];
                normal[m][0] = normal_2[m][0];
                normal[m][1] = normal_2[m][1];
            }
            chi = chi_2;
            damping /= 10;
        } else if ((damping *= 10) > (REAL)1e12) {
            break;
        }
    }
    *variance = spread_F(t, normal);
    return (x[0] > t->lo[0] && x[0] < t->hi[0] && *variance > 0 && isfinite(chi)) ? chi : INFINITY;
}

/* Settles every start, the best first, and forgets those that lead nowhere; how many there are. */
static int refined_F(const tap_F *t, REAL (*at)[2], int n, REAL *chi, REAL *variance)
{
    REAL least = INFINITY;
    int i, kept = 0;
    for (i = 0; i < n; i++) {
        REAL x[2] = {at[i][0], at[i][1]}, v, c = settle_F(t, x, &v);
        if (c < INFINITY) {
            int k = kept++;
            least = (c < least) ? c : least;
            while (k > 0 && chi[k - 1] > c) {
                at[k][0] = at[k - 1][0];
                at[k][1] = at[k - 1][1];
                chi[k] = chi[k - 1];
                variance[k] = variance[k - 1];
                k--;
            }
            at[k][0] = x[0];
            at[k][1] = x[1];
            chi[k] = c;
            variance[k] = v;
        }
    }
    /* Of several that fit equally well the farthest of the calibrated ones, or of all, comes first. */
    for (i = 1; i < kept; i++) {
        const side_F *s = t->side[0];
        int inside = at[i][0] >= s->nearest && at[i][0] <= s->farthest, other = at[0][0] >= s->nearest && at[0][0] <= s->farthest;
        if (chi[i] <= least + @EQUAL && (inside > other || (inside == other && at[i][0] > at[0][0]))) {
            REAL a = at[0][0], u = at[0][1], c = chi[0], v = variance[0];
            at[0][0] = at[i][0];
            at[0][1] = at[i][1];
            chi[0] = chi[i];
            variance[0] = variance[i];
            at[i][0] = a;
            at[i][1] = u;
            chi[i] = c;
            variance[i] = v;
        }
    }
    return kept;
}

/* Places of a grid that fit better than those beside them; how many there are. */
static int starts_F(const tap_F *t, REAL (*at)[2])
{
    REAL best[@STARTS_A], drive[@STARTS_A], a[@STARTS_A], x[2], c, normal[2][2], gradient[2];
    int i, j, n = 0, drives = (t->unknowns == 2) ? @STARTS_U : 1;
    for (i = 0; i < @STARTS_A; i++) {
        a[i] = x[0] = t->lo[0] + (t->hi[0] - t->lo[0]) * ((REAL)i + (REAL)0.5) / @STARTS_A;
        best[i] = INFINITY;
        drive[i] = t->drive;
        for (j = 0; j < drives; j++) {
            x[1] = (drives == 1) ? t->drive : t->lo[1] + (t->hi[1] - t->lo[1]) * ((REAL)j + (REAL)0.5) / @STARTS_U;
            c = misfit_F(t, x, normal, gradient);
            if (c < best[i]) {
                best[i] = c;
                drive[i] = x[1];
            }
        }
    }
    for (i = 0; i < @STARTS_A; i++) {
        if (best[i] < INFINITY && (i == 0 || best[i - 1] >= best[i]) && (i + 1 == @STARTS_A || best[i + 1] >= best[i])) {
            at[n][0] = a[i];
            at[n++][1] = drive[i];
        }
    }
    return n;
}

int vibrissa_locate_F(REAL drive, const REAL *signals, const REAL *zeros, REAL *distance_mm, REAL *sigma_mm, REAL *drive_found)
{
    tap_F t;
    REAL noise[@CHANNELS][@CHANNELS], at[@STARTS_A][2], chi[@STARTS_A], variance[@STARTS_A], y, slack, sigma, freedom, left;
    int used[@CHANNELS], status = VIBRISSA_OK, k, i, j, n, zero = 1, gauge = -1, at_end;
    *distance_mm = NAN;
    *sigma_mm = NAN;
    *drive_found = NAN;
@PREPARE
    t.drive = drive;
    t.unknowns = isfinite(drive) ? 1 : 2;
    t.n = 0;
    t.lo[0] = t.lo[1] = 0;
    t.hi[0] = t.hi[1] = INFINITY;
    if (drive == INFINITY || drive == -INFINITY) {
        return VIBRISSA_BAD_INPUT;
    }
    for (k = 0; k < @CHANNELS; k++) {
        const channel_F *c = channels_F + k;
        const side_F *s = sides_F + c->first;
        if (signals[k] == INFINITY || signals[k] == -INFINITY) {
            return VIBRISSA_BAD_INPUT;
        }
        y = signals[k] - (zeros ? zeros[k] : c->zero);
        y = (c->bridge > 0) ? ((y < 500) ? y / 1000 * 4 / (c->bridge * (1 - y / 500)) : NAN) : y * c->per;
        zero = zero && y == 0;
        if (!isfinite(y) || y == 0) {
            continue;
        }
        for (i = 0; i < c->count && (s->sign > 0) != (y > 0); i++) {
            s++;
        }
        used[t.n] = k;
        t.origin[t.n] = c->origin;
        t.signal[t.n] = y;
        t.side[t.n++] = (i < c->count) ? s : 0;
        status |= (i < c->count && fabs_F(y) > s->limit) ? VIBRISSA_STRAIN_LIMIT : VIBRISSA_OK;
    }
    if (t.n < t.unknowns) {
        return zero ? VIBRISSA_NO_STRAIN : VIBRISSA_BAD_INPUT;
    }
    for (i = 0; i < t.n; i++) {
        const side_F *s = t.side[i];
        if (!s) {
            return status | VIBRISSA_OUTSIDE_CALIBRATION;
        }
        /* No tap pulls one channel to its one side and another to its other. */
        if (s->gauge >= 0 && gauge >= 0 && s->gauge != gauge) {
            return status | VIBRISSA_NO_ROOT;
        }
        gauge = (s->gauge >= 0) ? s->gauge : gauge;
        y = drive - t.origin[i];
        if (t.unknowns == 1 && (y < s->drives[0] * (1 - @SAME) || y > s->drives[1] * (1 + @SAME))) {
            return status | VIBRISSA_OUTSIDE_CALIBRATION;
        }
        for (j = 0; j < 2; j++) {
            REAL lo = j ? s->drives[0] + t.origin[i] : exp_F(s->ln_a[0]), hi = j ? s->drives[1] + t.origin[i] : exp_F(s->ln_a[1]);
            t.lo[j] = (lo > t.lo[j]) ? lo : t.lo[j];
            t.hi[j] = (hi < t.hi[j]) ? hi : t.hi[j];
        }
        for (j = 0; j < t.n; j++) {
            noise[i][j] = covariance_F[used[i] * @CHANNELS + used[j]];
        }
    }
    if (!(t.lo[0] < t.hi[0] && t.lo[1] <= t.hi[1]) || !factor_F(&t, noise)) {
        return status | VIBRISSA_OUTSIDE_CALIBRATION;
    }
    n = refined_F(&t, at, starts_F(&t, at), chi, variance);
    if (n == 0) {
        return status | VIBRISSA_NO_ROOT;
    }
    /* With what the calibrations leave, where the tap is. */
    for (i = 0; i < t.n; i++) {
        left = left_F(t.side[i], at[0][0], ((t.unknowns == 2) ? at[0][1] : drive) - t.origin[i]);
        noise[i][i] += left;
    }
    n = factor_F(&t, noise) ? refined_F(&t, at, n, chi, variance) : 0;
    if (n == 0) {
        return status | VIBRISSA_NO_ROOT;
    }
    at_end = t.unknowns == 2 && (at[0][1] <= t.lo[1] || at[0][1] >= t.hi[1]);
    freedom = (REAL)(t.n - t.unknowns + at_end);
    if (freedom > 0 && chi[0] > @CONTRADICTORY + 4 * freedom) {
        return status | (at_end ? VIBRISSA_OUTSIDE_CALIBRATION : VIBRISSA_NO_ROOT);
    }
    sigma = sqrt_F(variance[0]) * ((freedom > 0 && chi[0] > freedom) ? sqrt_F(chi[0] / freedom) : 1);
    for (i = 1; i < n; i++) {
        if (chi[i] - chi[0] < 1 && fabs_F(at[i][0] - at[0][0]) > 3 * sigma) {
            y = at[i][0];
            status |= (y >= t.side[0]->interest[0] && y <= t.side[0]->interest[1]) ? VIBRISSA_AMBIGUOUS : VIBRISSA_OK;
            break;
        }
    }
    slack = (t.side[0]->farthest - t.side[0]->nearest) / 2;
    slack = ((@BEYOND * sigma < slack) ? @BEYOND * sigma : slack) + t.side[0]->rounding;
    if (at[0][0] < t.side[0]->nearest - slack || at[0][0] > t.side[0]->farthest + slack) {
        status |= VIBRISSA_OUTSIDE_CALIBRATION;
    }
    if (sigma > t.side[0]->farthest - t.side[0]->nearest) {
        status |= VIBRISSA_AMBIGUOUS;
    }
    *distance_mm = at[0][0];
    *sigma_mm = sigma;
    *drive_found = (t.unknowns == 2) ? at[0][1] : drive;
    return status;
}
