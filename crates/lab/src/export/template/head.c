/* Distance of a contact from the signal of a whisker: one calibration, one file, no dependency.
   Written by vibrissa @VERSION (estimator: @ESTIMATOR).

@WHISKER   signal       @UNIT
   drive        @DRIVE
   @DOMAINS
   sigma        noise of one reading (@NOISE), of the calibration, bias; @BEYOND sigma beyond the distances is outside
   error        to `vibrissa locate`, measured: up to @OFF;
                next to the peak of the signal more; float: 5e-5 mm more
   data         @DATA
   calibration  SHA-256 @CHECKSUM
*/
#ifndef VIBRISSA_LOCATE
#define VIBRISSA_LOCATE

#ifdef __cplusplus
extern "C" { /* so that C++ links with this file compiled as C */
#endif

/* What is returned: VIBRISSA_OK, or the sum of what there is to say. */
enum {
    VIBRISSA_OK = 0,
    VIBRISSA_NO_STRAIN = 1,            /* the signal is zero; no distance */
    VIBRISSA_STRAIN_LIMIT = 2,         /* above the strain limit of the gauge; without a distance: the sensor is at its end stop */
    VIBRISSA_NO_ROOT = 4,              /* no distance gives this signal: it is above the peak */
    VIBRISSA_AMBIGUOUS = 8,            /* a second distance in the range of interest gives it too; the farther one is given */
    VIBRISSA_OUTSIDE_CALIBRATION = 16, /* the drive or the side was not calibrated (no distance), or the distance lies beyond */
    VIBRISSA_BAD_INPUT = 32            /* an argument is no finite number */
};

/* The zero of the calibration's own signal where it is known, else 0: for taps whose zero was not read. */
#define VIBRISSA_ZERO @ZERO

/* Distance of the contact and its standard deviation, mm, from a tap by `drive` (@DRIVE) and its signal (@UNIT);
   `zero` is the signal without contact. NAN where there is no distance. */
int vibrissa_locate(double drive, double signal, double zero, double *distance_mm, double *sigma_mm);
int vibrissa_locatef(float drive, float signal, float zero, float *distance_mm, float *sigma_mm);

#ifdef __cplusplus
}
#endif

#endif

#ifndef VIBRISSA_DECLARATIONS_ONLY
#include <math.h>

/* Distance, mm, and s times its standard deviation, by strip, row, part and place s. */
static const float vibrissa_table[] = {
@VALUES
};
