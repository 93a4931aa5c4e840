/* A stand-in for libpath50 with the functions that lib/lcp/path_library.cpp uses: solves LCPs by projected Gauss-Seidel.
   Its licence covers 10 unknowns, or none where PATH_STUB_REFUSES is set (found in the solve, not before). It gives up
   with the ending PATH_STUB_ENDS, and is content after PATH_STUB_SWEEPS, where these are set. With PATH_STUB_APART it
   asks for the function and for the Jacobian one after the other. Its answer's first number is PATH_STUB_ANSWERS, and
   there is no answer where that is "nothing". */
#include <stdlib.h>
#include <string.h>

typedef struct {
  void* data;
  void (*size)(void*, int*, int*);
  void (*bounds)(void*, int, double*, double*, double*);
  int (*function)(void*, int, double*, double*);
  int (*jacobian)(void*, int, double*, int, double*, int*, int*, int*, int*, double*);
  void* optional[6];
} Interface;

typedef struct {
  int n;
  double* z;
  Interface interface;
} Mcp;

void Output_SetInterface(void* output) { (void)output; }
int Path_CheckLicense(int n, int nonzeros) { return n <= 10 && nonzeros <= 100; }
void* Options_Create(void) { return malloc(1); }
void Options_Destroy(void* options) { free(options); }
void Path_AddOptions(void* options) { (void)options; }
void Options_Default(void* options) { (void)options; }

void* MCP_Create(int n, int nonzeros) {
  Mcp* mcp = malloc(sizeof *mcp);
  (void)nonzeros;
  mcp->n = n;
  mcp->z = calloc((size_t)n, sizeof(double));
  return mcp;
}
void MCP_Destroy(Mcp* mcp) {
  free(mcp->z);
  free(mcp);
}
void MCP_SetInterface(Mcp* mcp, const Interface* interface) { mcp->interface = *interface; }
double* MCP_GetX(Mcp* mcp) {
  const char* answers = getenv("PATH_STUB_ANSWERS");
  if (answers && strcmp(answers, "nothing") == 0) return NULL;
  if (answers) mcp->z[0] = strtod(answers, NULL);
  return mcp->z;
}

int Path_Solve(Mcp* mcp, void* information) {
  const char *ends = getenv("PATH_STUB_ENDS"), *sweeps = getenv("PATH_STUB_SWEEPS");
  const int n = mcp->n, licence_error = 11, solved = 1, iterations = sweeps ? atoi(sweeps) : 20000;
  if (getenv("PATH_STUB_REFUSES")) return licence_error;
  if (ends) return atoi(ends);
  int size, nonzeros, i, j, k, sweep;
  double *lower = malloc(sizeof(double) * (size_t)n), *upper = malloc(sizeof(double) * (size_t)n);
  double *f = malloc(sizeof(double) * (size_t)n), *value, *diagonal = calloc((size_t)n, sizeof(double));
  int *column = malloc(sizeof(int) * (size_t)n), *length = malloc(sizeof(int) * (size_t)n), *row;
  mcp->interface.size(mcp->interface.data, &size, &nonzeros);
  row = malloc(sizeof(int) * (size_t)nonzeros);
  value = malloc(sizeof(double) * (size_t)nonzeros);
  mcp->interface.bounds(mcp->interface.data, n, mcp->z, lower, upper);
  const int apart = getenv("PATH_STUB_APART") != NULL;
  if (apart) mcp->interface.function(mcp->interface.data, n, mcp->z, f);
  mcp->interface.jacobian(mcp->interface.data, n, mcp->z, !apart, apart ? NULL : f, &nonzeros, column, length, row,
                          value);
  for (j = 0; j < n; ++j)
    for (k = column[j] - 1; k < column[j] - 1 + length[j]; ++k)
      if (row[k] == j + 1) diagonal[j] = value[k];
  for (sweep = 0; sweep < iterations; ++sweep)
    for (i = 0; i < n; ++i) {
      double z = mcp->z[i] - f[i] / diagonal[i];
      z = z < lower[i] ? lower[i] : z > upper[i] ? upper[i] : z;
      /* f follows by the column: the Jacobian is used, not only the function. */
      for (k = column[i] - 1; k < column[i] - 1 + length[i]; ++k) f[row[k] - 1] += value[k] * (z - mcp->z[i]);
      mcp->z[i] = z;
    }
  memcpy((char*)information + 5 * sizeof(double) + sizeof(int), &sweep, sizeof(int));
  free(lower), free(upper), free(f), free(value), free(diagonal), free(column), free(length), free(row);
  return solved;
}
