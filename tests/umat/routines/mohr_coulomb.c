/* Perfectly plastic Mohr-Coulomb with the Abaqus UMAT argument list; plane strain and solids.

   PROPS: E, nu, c, phi, psi [degrees]. The trial stress is returned in principal space, compression positive, to the
   face s1 = k s3 + 2 c sqrt(k), one of its edges, or the apex. DDSDDE is made of central differences of the stress.
   STATEV(1): number of plastic increments. */
#include <math.h>
#include <string.h>

static void jacobi(double a[3][3], double v[3][3])
{
    memset(v, 0, 9 * sizeof(double));
    for (int i = 0; i < 3; i++) v[i][i] = 1.0;
    for (int sweep = 0; sweep < 30; sweep++)
        for (int p = 0; p < 2; p++)
            for (int q = p + 1; q < 3; q++) {
                if (fabs(a[p][q]) < 1e-300) continue;
                double theta = 0.5 * (a[q][q] - a[p][p]) / a[p][q];
                double t = (theta >= 0 ? 1.0 : -1.0) / (fabs(theta) + sqrt(theta * theta + 1.0));
                double c = 1.0 / sqrt(t * t + 1.0), s = t * c;
                for (int k = 0; k < 3; k++) {
                    double x = a[k][p], y = a[k][q];
                    a[k][p] = c * x - s * y, a[k][q] = s * x + c * y;
                }
                for (int k = 0; k < 3; k++) {
                    double x = a[p][k], y = a[q][k];
                    a[p][k] = c * x - s * y, a[q][k] = s * x + c * y;
                    x = v[k][p], y = v[k][q];
                    v[k][p] = c * x - s * y, v[k][q] = s * x + c * y;
                }
            }
}

/* Return s (largest first) to the yield surface; 1 where plastic. */
static int corrected(double s[3], double k, double m, double strength, double lame, double shear)
{
    if (s[0] - k * s[2] - strength <= 0.0) return 0;
    /* faces: s_high - k s_low, on s0-s2 and its neighbours s1-s2 and s0-s1 */
    static const int high[3] = {0, 1, 0}, low[3] = {2, 2, 1};
    double flow[3][3], gradient[3][3], out[3], trial[3];
    memcpy(trial, s, sizeof trial);
    for (int f = 0; f < 3; f++)
        for (int i = 0; i < 3; i++) {
            double way = (i == high[f]) - m * (i == low[f]);
            gradient[f][i] = (i == high[f]) - k * (i == low[f]);
            flow[f][i] = lame * (1.0 - m) + 2.0 * shear * way;
        }
#define VALUE(f) (trial[high[f]] - k * trial[low[f]] - strength)
#define BY(f, g) (gradient[f][0] * flow[g][0] + gradient[f][1] * flow[g][1] + gradient[f][2] * flow[g][2])
    for (int i = 0; i < 3; i++) out[i] = trial[i] - VALUE(0) / BY(0, 0) * flow[0][i];
    if (out[0] < out[1] || out[1] < out[2]) {
        int g = out[0] < out[1] ? 1 : 2;
        double det = BY(0, 0) * BY(g, g) - BY(0, g) * BY(g, 0);
        double a = (VALUE(0) * BY(g, g) - VALUE(g) * BY(0, g)) / det;
        double b = (VALUE(g) * BY(0, 0) - VALUE(0) * BY(g, 0)) / det;
        for (int i = 0; i < 3; i++) out[i] = trial[i] - a * flow[0][i] - b * flow[g][i];
        if (a < 0.0 || b < 0.0 || out[0] < out[2])
            for (int i = 0; i < 3; i++) out[i] = -strength / (k - 1.0);
    }
    memcpy(s, out, sizeof out);
    return 1;
}

static int update(const double *props, int ntens, const double *old, const double *dstran, double *stress)
{
    const double degree = 0.017453292519943295;
    double shear = props[0] / (2.0 * (1.0 + props[1])), lame = 2.0 * shear * props[1] / (1.0 - 2.0 * props[1]);
    double k = (1.0 + sin(degree * props[3])) / (1.0 - sin(degree * props[3]));
    double m = (1.0 + sin(degree * props[4])) / (1.0 - sin(degree * props[4]));
    double x[6] = {0}, a[3][3], v[3][3], s[3];
    double volume = dstran[0] + dstran[1] + dstran[2];
    for (int i = 0; i < ntens; i++)
        x[i] = -(old[i] + (i < 3 ? lame * volume + 2.0 * shear * dstran[i] : shear * dstran[i]));
    a[0][0] = x[0], a[1][1] = x[1], a[2][2] = x[2];
    a[0][1] = a[1][0] = x[3], a[0][2] = a[2][0] = x[4], a[1][2] = a[2][1] = x[5];
    jacobi(a, v);
    int order[3] = {0, 1, 2};
    for (int i = 0; i < 2; i++)
        for (int j = 0; j < 2 - i; j++)
            if (a[order[j]][order[j]] < a[order[j + 1]][order[j + 1]]) {
                int t = order[j];
                order[j] = order[j + 1], order[j + 1] = t;
            }
    for (int i = 0; i < 3; i++) s[i] = a[order[i]][order[i]];
    int plastic = corrected(s, k, m, 2.0 * props[2] * sqrt(k), lame, shear);
    static const int row[6] = {0, 1, 2, 0, 0, 1}, column[6] = {0, 1, 2, 1, 2, 2};
    for (int i = 0; i < ntens; i++) {
        stress[i] = 0.0;
        for (int p = 0; p < 3; p++) stress[i] -= s[p] * v[row[i]][order[p]] * v[column[i]][order[p]];
    }
    return plastic;
}

void umat_(double *stress, double *statev, double *ddsdde, double *sse, double *spd, double *scd, double *rpl,
           double *ddsddt, double *drplde, double *drpldt, const double *stran, const double *dstran,
           const double *time, const double *dtime, const double *temp, const double *dtemp, const double *predef,
           const double *dpred, const char *cmname, const int *ndi, const int *nshr, const int *ntens,
           const int *nstatv, const double *props, const int *nprops, const double *coords, const double *drot,
           double *pnewdt, const double *celent, const double *dfgrd0, const double *dfgrd1, const int *noel,
           const int *npt, const int *layer, const int *kspt, const int *kstep, const int *kinc)
{
    const double h = 1e-7;
    double old[6], up[6], down[6], moved[6];
    int n = *ntens;
    if (*ndi != 3 || *nprops < 5) {
        *pnewdt = 0.25;
        return;
    }
    memcpy(old, stress, n * sizeof(double));
    for (int j = 0; j < n; j++) {
        memcpy(moved, dstran, n * sizeof(double));
        moved[j] = dstran[j] + h;
        update(props, n, old, moved, up);
        moved[j] = dstran[j] - h;
        update(props, n, old, moved, down);
        for (int i = 0; i < n; i++) ddsdde[j * n + i] = (up[i] - down[i]) / (2.0 * h);
    }
    int plastic = update(props, n, old, dstran, stress);
    if (*nstatv > 0) statev[0] += plastic;
}
