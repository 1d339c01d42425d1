/* driver LIBRARY NTENS NSTATV STEPS: call umat_ as a finite-element code does, with state handed on from call to call.
   Standard input: number of PROPS, PROPS, STRESS, then DSTRAN of every step. Prints PNEWDT, STRESS, DDSDDE and STATEV
   of every step as hexadecimal numbers. What the routine has no use for is NULL. */
#include <dlfcn.h>
#include <stdio.h>
#include <stdlib.h>

typedef void Umat(double *, double *, double *, double *, double *, double *, double *, double *, double *, double *,
                  double *, double *, double *, double *, double *, double *, double *, double *, char *, int *, int *,
                  int *, int *, double *, int *, double *, double *, double *, double *, double *, double *, int *,
                  int *, int *, int *, int *, int *, size_t);

static void numbers(double *to, int n)
{
    for (int i = 0; i < n; i++)
        if (scanf("%lf", to + i) != 1) exit(3);
}

static void print(const double *from, int n)
{
    for (int i = 0; i < n; i++) printf(" %a", from[i]);
}

int main(int argc, char **argv)
{
    void *library = argc == 5 ? dlopen(argv[1], RTLD_NOW) : NULL;
    Umat *umat = library ? (Umat *)dlsym(library, "umat_") : NULL;
    if (!umat) return 2;
    int ntens = atoi(argv[2]), nstatv = atoi(argv[3]), steps = atoi(argv[4]), ndi = 3, nshr = ntens - 3, nprops, one = 1;
    double props[16], stress[6], dstran[6], stran[6] = {0}, ddsdde[36], time[2] = {0}, dtime = 1.0, count;
    double *statev = calloc(nstatv, sizeof(double));
    char name[80] = "CH";
    numbers(&count, 1);
    nprops = (int)count;
    numbers(props, nprops);
    numbers(stress, ntens);
    for (int step = 0; step < steps; step++) {
        double pnewdt = 1.0, energy[3] = {0};
        numbers(dstran, ntens);
        umat(stress, statev, ddsdde, energy, energy + 1, energy + 2, NULL, NULL, NULL, NULL, stran, dstran, time, &dtime,
             NULL, NULL, NULL, NULL, name, &ndi, &nshr, &ntens, &nstatv, props, &nprops, NULL, NULL, &pnewdt, NULL,
             NULL, NULL, &one, &one, &one, &one, &one, &step, sizeof name);
        print(&pnewdt, 1), print(stress, ntens), print(ddsdde, ntens * ntens), print(statev, nstatv);
        printf("\n");
        for (int i = 0; i < ntens; i++) stran[i] += dstran[i];
        time[0] = time[1] += dtime;
    }
    free(statev);
    return 0;
}
