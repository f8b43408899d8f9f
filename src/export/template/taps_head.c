
/* The same of @TAPS taps of one object, by the drives @DRIVES in this order, above one zero: what all of them tell together. Each
   must have a distance of its own: what is said of one that has none is returned. */
#define VIBRISSA_TAPS @TAPS
int vibrissa_taps(const double *signals, double zero, double *distance_mm, double *sigma_mm);
int vibrissa_tapsf(const float *signals, float zero, float *distance_mm, float *sigma_mm);
