// A program that declares what locate.c defines.
#define VIBRISSA_DECLARATIONS_ONLY
#include "locate.c"
#include <cstdio>
int main()
{
    double a, sigma;
    int status = vibrissa_locate(4.0, 0.0212, VIBRISSA_ZERO, &a, &sigma);
    std::printf("%.6f %.6f %d\n", a, sigma, status);
    return 0;
}
