/* Times of the code that pinocchio_codegen wrote, per call, in ns: as pinocchio_bench.cpp, its CSV. Compiled together with recursions.c. */
#include <stdio.h>
#include <stdlib.h>
#include <time.h>

enum { STATES = 64, BATCHES = 101, CALLS = 1000, MOST = 4096 };

typedef int (*Recursion)(const double**, double**, long long*, double*, int);
typedef int (*Sizes)(long long*, long long*, long long*, long long*);

static double state[3][STATES][MOST], result[MOST * 16], used = 0.0;

static int by_size(const void* a, const void* b)
{
  const double x = *(const double*)a, y = *(const double*)b;
  return (x > y) - (x < y);
}

static double now_ns(void)
{
  struct timespec t;
  clock_gettime(CLOCK_MONOTONIC, &t);
  return 1e9 * (double)t.tv_sec + (double)t.tv_nsec;
}

static void bench(const char* build, const char* model, const char* what, Recursion call, Sizes sizes)
{
  long long n_arg, n_res, n_iw, n_w;
  sizes(&n_arg, &n_res, &n_iw, &n_w);
  const double** arg = malloc((size_t)(n_arg + 4) * sizeof(*arg));
  double** res = malloc((size_t)(n_res + 1) * sizeof(*res));
  long long* iw = malloc((size_t)(n_iw + 1) * sizeof(*iw));
  double* w = malloc((size_t)(n_w + 1) * sizeof(*w));
  double ns[BATCHES];
  for (int batch = 0; batch < BATCHES; ++batch) {
    const double begin = now_ns();
    for (int i = 0; i < CALLS; ++i) {
      for (int k = 0; k < 3; ++k) arg[k] = state[k][i % STATES];
      res[0] = result;
      call(arg, res, iw, w, 0);
      used += result[0];
    }
    ns[batch] = (now_ns() - begin) / CALLS;
  }
  qsort(ns, BATCHES, sizeof(*ns), by_size);
  printf("%s,%s,%s,%.0f,%.0f\n", build, model, what, ns[0], ns[BATCHES / 2]);
  free(arg);
  free(res);
  free(iw);
  free(w);
}

#define LINE(model, what, inputs) \
  int model##_##what(const double**, double**, long long*, double*, int); \
  int model##_##what##_work(long long*, long long*, long long*, long long*);
#include "table.inc"
#undef LINE

int main(int argc, char** argv)
{
  const char* build = argc > 1 ? argv[1] : "generated";
  srand(1);
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < STATES; ++i)
      for (int j = 0; j < MOST; ++j) state[k][i][j] = (double)rand() / RAND_MAX - 0.5;
#define LINE(model, what, inputs) bench(build, #model, #what, model##_##what, model##_##what##_work);
#include "table.inc"
  fprintf(stderr, "sum of all results: %.6g\n", used);
  return 0;
}
