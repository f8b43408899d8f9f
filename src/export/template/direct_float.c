
/* The terms of the polynomial nearly cancel: float has too few digits for them, and it is read in double. */
static int direct_F(const side_F *side, REAL drive, REAL signal, found_F *found)
{
    found_d exact = {0, 0, 0, 0, 0};
    int why = direct_d(sides_d + (side - sides_F), drive, signal, &exact);
    found->a = (REAL)exact.a;
    found->of_signal = (REAL)exact.of_signal;
    found->variance = (REAL)exact.variance;
    return why;
}
