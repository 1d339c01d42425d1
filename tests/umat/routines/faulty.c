/* A routine with one fault at a time, chosen by PROPS(1): 0 none, 1 changes DSTRAN, 2 writes beyond STRESS,
   3 keeps a hidden state, 4 leaves DDSDDE alone, 5 wrong DDSDDE, 6 asks for a smaller increment, 7 NaN,
   8 ends the process, 9 engineering shear taken for tensor shear, 10 order 12, 23, 13 of a routine for another code,
   11 depends on DTIME. E = 1e4, nu = 0. 10 has a stiffer 13 shear, in its own order. */
#include <math.h>
#include <stdlib.h>

void umat_(double *stress, double *statev, double *ddsdde, double *sse, double *spd, double *scd, double *rpl,
           double *ddsddt, double *drplde, double *drpldt, const double *stran, double *dstran, const double *time,
           const double *dtime, const double *temp, const double *dtemp, const double *predef, const double *dpred,
           const char *cmname, const int *ndi, const int *nshr, const int *ntens, const int *nstatv,
           const double *props, const int *nprops, const double *coords, const double *drot, double *pnewdt)
{
    static double hidden = 1.0;
    const double young = 1e4;
    int fault = (int)props[0], n = *ntens;
    double factor = fault == 11 ? 1.0 + *dtime : 1.0;
    if (fault == 3) factor = (hidden += 0.1);
    if (fault == 6) *pnewdt = 0.5;
    if (fault == 8) exit(7);
    for (int i = 0; i < n; i++) {
        double modulus = factor * young * (i < *ndi ? 1.0 : fault == 9 ? 1.0 : 0.5);
        stress[i] += modulus * dstran[i];
        if (fault != 4) ddsdde[i * n + i] = fault == 5 ? 2.0 * modulus : modulus;
    }
    /* the routine of another code reads components 5 and 6 as 23 and 13, and couples 12 with 13 */
    if (fault == 10 && n == 6) stress[3] += young * dstran[4], ddsdde[4 * n + 3] = young;
    if (fault == 1) dstran[0] = 0.0;
    if (fault == 2) stress[n] = 1.0;
    if (fault == 7) stress[0] = NAN;
}
