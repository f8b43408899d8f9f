
/* ---- REAL ---- */

typedef struct {
    REAL a, near, of_signal; /* distance and the next one, mm (0: none); (d a/d ln signal)^2, mm^2 */
    REAL variance;           /* of ln signal, from the calibration */
    REAL sigma;              /* of the distance, mm, where it is not made of these (0: it is) */
} found_F;

typedef struct {
    int sign, first, count;           /* sign of the signal; strips, or number of the polynomial where count is 0 */
    int drives, drive_count;          /* place among the calibrated drives */
    REAL nearest, farthest, rounding; /* calibrated distances, mm */
    REAL interest[2];                 /* distances within which a second one is ambiguous */
    REAL limit, end_stop;             /* |signal| of the strain limit and of the sensor's end stop */
    REAL alone;                       /* ln(signal at the farthest distance/signal) from which a near distance is the only one */
    int cut, if_weak, if_strong;
} side_F;

@TABLES
