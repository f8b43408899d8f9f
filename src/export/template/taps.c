
/* Place of ln a = x among the tables of several taps: the first of NEAR points, and how far beyond it, in steps. */
static int near_F(const learned_F *l, REAL x, REAL *t)
{
    REAL s = (x - l->from) / l->step;
    int k;
    s = (s < 0) ? 0 : (s > @POINTS - 1) ? @POINTS - 1 : s;
    k = (int)s + 1 - @NEAR / 2;
    k = (k < 0) ? 0 : (k > @POINTS - @NEAR) ? @POINTS - @NEAR : k;
    *t = s - (REAL)k;
    return k;
}

/* The polynomial through NEAR values, `apart` from each other in memory, at t, and its slope. */
static REAL through_F(const REAL *values, int apart, REAL t, REAL *slope)
{
    REAL sum = 0, weight, rise, part;
    int i, j, m;
    *slope = 0;
    for (i = 0; i < @NEAR; i++) {
        weight = 1;
        rise = 0;
        for (j = 0; j < @NEAR; j++) {
            if (j != i) {
                weight *= (t - (REAL)j) / (REAL)(i - j);
                part = 1 / (REAL)(i - j);
                for (m = 0; m < @NEAR; m++) {
                    part *= (m != i && m != j) ? (t - (REAL)m) / (REAL)(i - m) : 1;
                }
                rise += part;
            }
        }
        sum += weight * values[i * apart];
        *slope += rise * values[i * apart];
    }
    return sum;
}

/* By how many standard deviations the farthest of the taps y is off what the others say at ln a = x, the distance free. */
static REAL apart_F(const learned_F *l, int table, const REAL *y, REAL x)
{
    const float *root;
    REAL w[@TAPS][@TAPS], off[@TAPS], wg[@TAPS], slope[@TAPS], t, gwg = 0, along = 0, z, most = 0;
    int i, j, m, k = near_F(l, x, &t);
    const REAL *signals = together_signals_F + (table * @POINTS + k) * @TAPS;
    m = k + (int)(t + (REAL)1 / 2);
    root = together_roots + (table * @POINTS + (m < @POINTS ? m : @POINTS - 1)) * @ROOT;
    for (i = 0; i < @TAPS; i++) {
        off[i] = y[i] - through_F(signals + i, @TAPS, t, slope + i);
        slope[i] /= l->step;
    }
    for (i = 0; i < @TAPS; i++) {
        for (j = 0; j < @TAPS; j++) {
            w[i][j] = 0;
            for (m = (i > j) ? i : j; m < @TAPS; m++) {
                w[i][j] += (REAL)root[m * (m + 1) / 2 + i] * (REAL)root[m * (m + 1) / 2 + j];
            }
        }
    }
    for (i = 0; i < @TAPS; i++) {
        wg[i] = 0;
        for (j = 0; j < @TAPS; j++) {
            wg[i] += w[i][j] * slope[j];
        }
        gwg += wg[i] * slope[i];
        along += wg[i] * off[i];
    }
    gwg += 1 / (@FREE * @FREE);
    for (i = 0; i < @TAPS; i++) {
        z = -wg[i] * along / gwg;
        for (j = 0; j < @TAPS; j++) {
            z += w[i][j] * off[j];
        }
        t = w[i][i] - wg[i] * wg[i] / gwg;
        z = fabs_F(z) / sqrt_F(t > 0 ? t : @SMALL);
        most = (z > most) ? z : most;
    }
    return most;
}

/* The distance that the taps y tell together, its standard deviation and the next one that fits (0: none), by their posterior over ln a. */
static int by_taps_F(const learned_F *l, int table, const REAL *y, REAL *a, REAL *sigma, REAL *near)
{
    REAL h[@POINTS], x[@POINTS], sd[@POINTS], share[@POINTS], fine[@FINE];
    REAL t, sum, slope, bend, lower, upper, mean, total = 0, top = -INFINITY, step = l->step;
    const REAL *signals = together_signals_F + table * @POINTS * @TAPS;
    const float *root = together_roots + table * @POINTS * @ROOT;
    int i, j, k, m, count = 0, first = -1, other = -1;
    for (k = 0; k < @POINTS; k++, signals += @TAPS, root += @ROOT) {
        sum = 0;
        for (i = 0; i < @TAPS; i++) {
            t = 0;
            for (j = 0; j <= i; j++) {
                t += (REAL)root[i * (i + 1) / 2 + j] * (y[j] - signals[j]);
            }
            sum += t * t;
        }
        h[k] = together_heights_F[table * @POINTS + k] - sum / 2;
    }
    /* Where it is highest, by parabolas through three points. */
    for (k = 0; k < @POINTS; k++) {
        if ((k > 0 && h[k] <= h[k - 1]) || (k < @POINTS - 1 && h[k] < h[k + 1])) {
            continue;
        }
        m = (k < 1) ? 1 : (k > @POINTS - 2) ? @POINTS - 2 : k;
        slope = (h[m + 1] - h[m - 1]) / 2;
        bend = 2 * h[m] - h[m - 1] - h[m + 1];
        t = (bend > 0) ? slope / bend : (REAL)(k - m);
        t = (t > 1) ? 1 : (t < -1) ? -1 : t;
        x[count] = l->from + step * ((REAL)m + t);
        sd[count] = (bend > 0) ? step / sqrt_F(bend) : INFINITY;
        share[count] = h[m] + slope * t - bend * t * t / 2;
        if (isfinite(share[count])) {
            top = (share[count] > top) ? share[count] : top;
            count++;
        }
    }
    for (i = 0; i < count; i++) {
        if (sd[i] < 2 * step) {
            share[i] = exp_F(share[i] - top) * sd[i] * @ROOT_TAU;
        } else {
            lower = (i > 0) ? (x[i] + x[i - 1]) / 2 : l->from;
            upper = (i + 1 < count) ? (x[i] + x[i + 1]) / 2 : l->from + step * @POINTS;
            sum = 0;
            mean = 0;
            bend = 0;
            for (k = 0; k < @POINTS; k++) {
                t = l->from + step * (REAL)k;
                if (t >= lower && t <= upper) {
                    slope = exp_F(h[k] - top);
                    sum += slope;
                    mean += slope * (t - x[i]);
                    bend += slope * (t - x[i]) * (t - x[i]);
                }
            }
            share[i] = sum * step;
            bend = (sum > 0) ? bend / sum - mean / sum * mean / sum : 0;
            sd[i] = (bend > 0) ? sqrt_F(bend) : step;
        }
        total += share[i];
    }
    /* The farthest that is likely. */
    for (i = count - 1; i >= 0; i--) {
        if (share[i] >= @SECOND * total) {
            if (first < 0) {
                first = i;
            } else if (other < 0 || share[i] > share[other]) {
                other = i;
            }
        }
    }
    if (first < 0 || (x[first] < l->from + step / 2 && x[first] < l->first - step)
        || (x[first] > l->from + step * (@POINTS - 1) - step / 2 && x[first] > l->last + step)) {
        return VIBRISSA_NO_ROOT; /* what is most likely lies beyond the table */
    }
    *near = (other < 0) ? 0 : exp_F(x[other]);
    lower = l->from;
    upper = l->from + step * (@POINTS - 1);
    for (i = 0; i < count; i++) {
        t = (x[i] + x[first]) / 2;
        if (share[i] > @NONE * total && i != first) {
            lower = (i < first && t > lower) ? t : lower;
            upper = (i > first && t < upper) ? t : upper;
        }
    }
    t = x[first] - @WINDOW * sd[first];
    lower = (t > lower) ? t : lower;
    t = x[first] + @WINDOW * sd[first];
    upper = (t < upper) ? t : upper;
    step = (upper - lower) / (@FINE - 1);
    top = -INFINITY;
    for (i = 0; i < @FINE; i++) {
        k = near_F(l, lower + step * (REAL)i, &t);
        fine[i] = through_F(h + k, 1, t, &slope);
        top = (fine[i] > top) ? fine[i] : top;
    }
    for (i = 0; i < @FINE; i++) {
        fine[i] = exp_F(fine[i] - top);
    }
    *a = exp_F(quantile_F(fine, lower, step, @HALF));
    *sigma = (exp_F(quantile_F(fine, lower, step, @HIGH)) - exp_F(quantile_F(fine, lower, step, @LOW))) / 2;
    return (isfinite(*a) && *sigma > 0) ? VIBRISSA_OK : VIBRISSA_NO_ROOT;
}

int vibrissa_taps_F(const REAL *signals, REAL zero, REAL *distance_mm, REAL *sigma_mm)
{
    const side_F *side = 0, *own;
    REAL y[@TAPS], drive, signal, near;
    int i, alone, status;
    for (i = 0; i < @TAPS; i++) {
        drive = together_drives_F[i];
        signal = signals[i];
        alone = vibrissa_locate_F(drive, signal, zero, distance_mm, sigma_mm);
        if (!isfinite(*distance_mm)) {
            return alone;
        }
@PREPARE
        (void)drive;
        for (own = sides_F; (signal > 0) != (own->sign > 0); own++) {
        }
        if ((side != 0 && own != side) || own->count > 0) {
            *distance_mm = NAN;
            *sigma_mm = NAN;
            return own->count > 0 ? VIBRISSA_OUTSIDE_CALIBRATION : VIBRISSA_INCONSISTENT;
        }
        side = own;
        y[i] = fabs_F(signal) - learneds_F[side->first].zero;
    }
    alone = by_taps_F(learneds_F + side->first, side->first, y, distance_mm, sigma_mm, &near);
    if (alone != VIBRISSA_OK) {
        *distance_mm = NAN;
        *sigma_mm = NAN;
        return alone;
    }
    status = doubts_F(side, *distance_mm, near, *sigma_mm);
    if (apart_F(learneds_F + side->first, side->first, y, log_F(*distance_mm)) > @APART) {
        status |= VIBRISSA_INCONSISTENT;
    }
    return status;
}
