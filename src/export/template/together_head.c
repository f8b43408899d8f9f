@COMMENT
#ifndef VIBRISSA_LOCATE
#define VIBRISSA_LOCATE

#ifdef __cplusplus
extern "C" { /* so that C++ links with this file compiled as C */
#endif

/* What is returned: VIBRISSA_OK, or the sum of what there is to say. */
enum {
    VIBRISSA_OK = 0,
    VIBRISSA_NO_STRAIN = 1,            /* all signals are zero; no distance */
    VIBRISSA_STRAIN_LIMIT = 2,         /* above the strain limit of the gauge */
    VIBRISSA_NO_ROOT = 4,              /* no distance explains these signals together */
    VIBRISSA_AMBIGUOUS = 8,            /* a second distance in the range of interest explains them as well */
    VIBRISSA_OUTSIDE_CALIBRATION = 16, /* the drive or a side was not calibrated (no distance), or the distance lies beyond */
    VIBRISSA_BAD_INPUT = 32            /* too few arguments are finite numbers */
};

/* Signals of a reading: @NAMES. */
#define VIBRISSA_CHANNELS @CHANNELS

/* Distance of the contact and its standard deviation, mm, from a tap by `drive` (@DRIVE; NAN where it is not known: then it is
   found, too) and the signals of all channels; a signal that is NAN is left out. `zeros` are the signals without contact; a null pointer
   stands for those of the calibration. NAN where there is no distance. `drive_found` is the drive that was given or found. */
int vibrissa_locate(double drive, const double *signals, const double *zeros, double *distance_mm, double *sigma_mm, double *drive_found);
int vibrissa_locatef(float drive, const float *signals, const float *zeros, float *distance_mm, float *sigma_mm, float *drive_found);

#ifdef __cplusplus
}
#endif

#endif

#ifndef VIBRISSA_DECLARATIONS_ONLY
#include <math.h>
