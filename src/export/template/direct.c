
/* The distance as a polynomial of ln signal and the drive. */
static int direct_F(const side_F *side, REAL drive, REAL signal, found_F *found)
{
    const polynomial_F *p = polynomials_F + side->first;
    REAL u = log_F(signal / p->middle) / p->half;
    REAL v = ((p->log_drive ? log_F(drive) : drive) - p->drive_middle) / p->drive_half;
    REAL t[@TERMS], a = 0, slope = 0, variance = 0, power, per, before;
    int i, j, n = 0, m;
    for (i = 0; i <= p->degree; i++) {
        for (j = 0; j <= p->drive_degree && i + j <= p->degree; j++) {
            before = 1;
            for (m = 1; m < i; m++) {
                before *= u;
            }
            power = 1;
            for (m = 0; m < j; m++) {
                power *= v;
            }
            t[n] = (i > 0) ? before * u * power : power;
            slope += numbers_F[p->coefficients + n] * i * before * power / p->half;
            a += numbers_F[p->coefficients + n] * t[n];
            n++;
        }
    }
    for (i = 0; i < n; i++) {
        for (j = 0; j < n; j++) {
            variance += t[i] * t[j] * numbers_F[p->covariance + i * n + j];
        }
    }
    if (p->log_a) {
        a = exp_F(a);
    }
    per = p->log_a ? a : 1;
    slope *= per;
    if (!(a >= p->reach[0] && a <= p->reach[1] && slope * p->sign > 0)) {
        return VIBRISSA_OUTSIDE_CALIBRATION;
    }
    found->a = a;
    found->of_signal = slope * slope;
    found->variance = variance * per * per / (slope * slope);
    return VIBRISSA_OK;
}
