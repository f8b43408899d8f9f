/* Reads lines of drive, signal, zero; writes distance, sigma and status by both precisions. */
#include "locate.c"
#include <stdio.h>
int main(void)
{
    double drive, signal, zero, a, sigma;
    float af, sigmaf;
    int status, statusf;
    while (scanf("%lf,%lf,%lf", &drive, &signal, &zero) == 3) {
        status = vibrissa_locate(drive, signal, zero, &a, &sigma);
        statusf = vibrissa_locatef((float)drive, (float)signal, (float)zero, &af, &sigmaf);
        printf("%.17g,%.17g,%d,%.9g,%.9g,%d\n", a, sigma, status, af, sigmaf, statusf);
    }
    return 0;
}
