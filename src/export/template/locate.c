
/* What there is to say of a distance. */
static int doubts_F(const side_F *side, REAL a, REAL near, REAL sigma)
{
    int status = VIBRISSA_OK;
    REAL slack = @BEYOND * sigma;
    if (near >= side->interest[0] && near <= side->interest[1]) {
        status |= VIBRISSA_AMBIGUOUS;
    }
    if (slack > (side->farthest - side->nearest) / 2) {
        slack = (side->farthest - side->nearest) / 2;
    }
    slack += side->rounding;
    if (a < side->nearest - slack || a > side->farthest + slack) {
        status |= VIBRISSA_OUTSIDE_CALIBRATION;
    }
    return status;
}

int vibrissa_locate_F(REAL drive, REAL signal, REAL zero, REAL *distance_mm, REAL *sigma_mm)
{
    const side_F *side = sides_F;
    const side_F *end = side + @SIDES;
    found_F found = {0, 0, 0, 0, 0};
    const REAL *drives;
    REAL size, share, bias, weight, sigma;
    int status = VIBRISSA_OK, why, j = 0;
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
    while (side < end && (signal > 0) != (side->sign > 0)) {
        side++;
    }
    if (side == end) {
        return VIBRISSA_OUTSIDE_CALIBRATION | (size > @LIMIT ? VIBRISSA_STRAIN_LIMIT : VIBRISSA_OK);
    }
    if (size > side->limit) {
        status = VIBRISSA_STRAIN_LIMIT;
    }
    drives = drives_F + side->drives;
    if (drive < drives[0] * (1 - @SAME) || drive > drives[side->drive_count - 1] * (1 + @SAME)) {
        return status | VIBRISSA_OUTSIDE_CALIBRATION;
    }
    if (size >= side->end_stop) {
        return status | VIBRISSA_STRAIN_LIMIT;
    }
    why = @FIND;
    if (why != VIBRISSA_OK) {
        return status | why;
    }
    while (j + 2 < side->drive_count && drive >= drives[j + 1]) {
        j++;
    }
    bias = bias_F[side->drives + j];
    if (side->drive_count > 1) {
        weight = (drive - drives[j]) / (drives[j + 1] - drives[j]);
        weight = (weight < 0) ? 0 : (weight > 1) ? 1 : weight;
        bias += weight * (bias_F[side->drives + j + 1] - bias);
    }
    share = @NOISE / size;
    sigma = (share * share + (found.variance > 0 ? found.variance : 0)) * found.of_signal + bias * bias;
    sigma = (found.sigma > 0) ? found.sigma : sqrt_F(sigma);
    if (!isfinite(sigma) || !isfinite(found.a)) {
        return status | VIBRISSA_NO_ROOT;
    }
    status |= doubts_F(side, found.a, found.near, sigma);
    *distance_mm = found.a;
    *sigma_mm = sigma;
    return status;
}
