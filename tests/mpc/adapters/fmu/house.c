/* A heated floor with BOPTEST's overwrites, for FMI 2.0 and (with -DFMI3) 3.0, each by co-simulation and model exchange.

   Zone: C_Z dT_Z/dt = UA (T_out - T_Z) + K (T_F - T_Z).  Floor: C_F dT_F/dt = K (T_Z - T_F) + 8000 W y.
   The house's own control is a thermostat (on below the setpoint - 0.5 K, off above + 0.5 K: state events) whose
   setpoint changes at 7 and 22 h (time events). An overwrite counts while its Boolean switch is true. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

enum { T_Z, T_F, DT_Z, DT_F, HEA_U, SET_U, T_OUT, P_HEA, Q_FLO, HEA_Y, SET_Y, AMPLITUDE, DEAF, MEAN, TZ_Y, REALS };
enum { HEA_ON, SET_ON, BOOLEANS };
static const double C_Z = 2e6, C_F = 1e7, UA = 150.0, K = 500.0, HOUR = 3600.0, PI = 3.14159265358979323846;

typedef struct { double time, next, v[REALS], scheduled; bool b[BOOLEANS], heats; int stage; } House;

static House* made(void) {
  House* h = calloc(1, sizeof(House));
  if (h) { h->v[T_Z] = h->v[T_F] = 293.15; h->v[SET_U] = 293.15; h->v[MEAN] = 273.15; }
  return h;
}
static void schedule(House* h) {
  double day = 24.0 * HOUR, start = floor(h->time / day) * day, clock = h->time - start + 1e-6;
  h->scheduled = clock >= 7.0 * HOUR && clock < 22.0 * HOUR ? 294.15 : 291.15;
  h->next = start + (clock < 7.0 * HOUR ? 7.0 : clock < 22.0 * HOUR ? 22.0 : 31.0) * HOUR;
}
static void compute(House* h) {
  double* v = h->v;
  v[T_OUT] = v[MEAN] + v[AMPLITUDE] * sin(2.0 * PI * h->time / (24.0 * HOUR));
  v[TZ_Y] = v[T_Z];
  v[SET_Y] = h->b[SET_ON] ? v[SET_U] : h->scheduled;
  v[HEA_Y] = h->b[HEA_ON] && v[DEAF] == 0.0 ? v[HEA_U] : (double)h->heats;
  v[Q_FLO] = 8000.0 * v[HEA_Y];
  v[P_HEA] = v[Q_FLO] / 3.0 + (v[HEA_Y] > 0.0 ? 100.0 : 0.0);
  v[DT_Z] = (UA * (v[T_OUT] - v[T_Z]) + K * (v[T_F] - v[T_Z])) / C_Z;
  v[DT_F] = (K * (v[T_Z] - v[T_F]) + v[Q_FLO]) / C_F;
}
static void event(House* h) { /* also at the begin, and when an input has changed */
  schedule(h);
  compute(h);
  if (h->v[T_Z] <= h->v[SET_Y] - 0.5) h->heats = true;
  if (h->v[T_Z] >= h->v[SET_Y] + 0.5) h->heats = false;
  compute(h);
}
static int advance(House* h, double until) { /* Runge-Kutta in steps of 5 s at most */
  while (h->time < until - 1e-9) {
    double t = h->time, s = fmin(5.0, until - t), x[2], k[4][2];
    event(h);
    if (h->v[HEA_Y] > 0.999 && h->v[T_Z] > 313.15) return 0; /* a solver that gives up */
    memcpy(x, h->v, sizeof x);
    for (int i = 0; i < 4; i++) {
      double part = i == 0 ? 0.0 : i == 3 ? s : 0.5 * s;
      h->time = t + part;
      for (int j = 0; j < 2; j++) h->v[j] = x[j] + (i ? part * k[i - 1][j] : 0.0);
      compute(h);
      memcpy(k[i], &h->v[DT_Z], sizeof k[i]);
    }
    for (int j = 0; j < 2; j++) h->v[j] = x[j] + s / 6.0 * (k[0][j] + 2.0 * k[1][j] + 2.0 * k[2][j] + k[3][j]);
    h->time = t + s;
  }
  h->time = until;
  compute(h);
  return 1;
}
static void indicators(House* h, double z[]) {
  compute(h);
  z[0] = h->v[T_Z] - h->v[SET_Y] + 0.5;
  z[1] = h->v[T_Z] - h->v[SET_Y] - 0.5;
}
static int in_model_exchange(House* h) { return !(h->v[P_HEA] > 0.0 && h->v[T_Z] > 313.15); }

#ifdef FMI3
#define API(name) fmi3##name
typedef bool Bool;
#define N_VALUES , size_t m
#define USE_M (void)m
#else
#define API(name) fmi2##name
typedef int Bool;
#define N_VALUES
#define USE_M (void)0
#endif
typedef unsigned int Ref;
typedef int Status; /* 0 OK, 2 discard, 3 error */

Status API(EnterInitializationMode)(void* c
#ifdef FMI3
                                    , Bool defined, double tolerance, double start, Bool stops, double stop) {
  (void)defined; (void)tolerance; (void)stops; (void)stop; ((House*)c)->time = start;
#else
) {
#endif
  event(c); return 0;
}
Status API(ExitInitializationMode)(void* c) { event(c); return 0; }
Status API(Terminate)(void* c) { (void)c; return 0; }
void API(FreeInstance)(void* c) { free(c); }
Status API(Reset)(void* c) { (void)c; return 3; }
#ifdef FMI3
Status fmi3GetFloat64(void* c, const Ref r[], size_t n, double v[], size_t m) {
#else
Status fmi2GetReal(void* c, const Ref r[], size_t n, double v[]) { size_t m = n;
#endif
  (void)m; compute(c);
  for (size_t i = 0; i < n; i++) v[i] = ((House*)c)->v[r[i]];
  return 0;
}
#ifdef FMI3
Status fmi3SetFloat64(void* c, const Ref r[], size_t n, const double v[], size_t m) {
#else
Status fmi2SetReal(void* c, const Ref r[], size_t n, const double v[]) { size_t m = n;
#endif
  (void)m;
  for (size_t i = 0; i < n; i++) ((House*)c)->v[r[i]] = v[i];
  return 0;
}
Status API(GetBoolean)(void* c, const Ref r[], size_t n, Bool v[] N_VALUES) {
  USE_M;
  for (size_t i = 0; i < n; i++) v[i] = r[i] == 102 ? ((House*)c)->heats : ((House*)c)->b[r[i] - 100];
  return 0;
}
Status API(SetBoolean)(void* c, const Ref r[], size_t n, const Bool v[] N_VALUES) {
  USE_M;
  for (size_t i = 0; i < n; i++) ((House*)c)->b[r[i] - 100] = v[i];
  return 0;
}
Status API(EnterEventMode)(void* c) { (void)c; return 0; }
Status API(EnterContinuousTimeMode)(void* c) { ((House*)c)->stage = 0; return 0; }
Status API(SetTime)(void* c, double time) { ((House*)c)->time = time; return 0; }
Status API(SetContinuousStates)(void* c, const double x[], size_t n) {
  memcpy(((House*)c)->v, x, n * sizeof(double)); return 0;
}
Status API(GetContinuousStates)(void* c, double x[], size_t n) {
  memcpy(x, ((House*)c)->v, n * sizeof(double)); return 0;
}
Status API(GetNominalsOfContinuousStates)(void* c, double x[], size_t n) {
  (void)c; for (size_t i = 0; i < n; i++) x[i] = 300.0; return 0;
}
Status API(GetEventIndicators)(void* c, double z[], size_t n) { (void)n; indicators(c, z); return 0; }
static Status derivatives(House* h, double dx[]) {
  compute(h);
  memcpy(dx, &h->v[DT_Z], 2 * sizeof(double));
  return in_model_exchange(h) ? 0 : 2;
}
Status API(CompletedIntegratorStep)(void* c, Bool keep, Bool* event_mode, Bool* ends) {
  (void)c; (void)keep; *event_mode = *ends = 0; return 0;
}

#ifdef FMI3
const char* fmi3GetVersion(void) { return "3.0"; }
void* fmi3InstantiateModelExchange(const char* n, const char* t, const char* p, bool v, bool l, void* e, void* m) {
  (void)n; (void)t; (void)p; (void)v; (void)l; (void)e; (void)m; return made();
}
void* fmi3InstantiateCoSimulation(const char* n, const char* t, const char* p, bool v, bool l, bool ev, bool early,
                                  const Ref* r, size_t nr, void* e, void* m, void* u) {
  (void)n; (void)t; (void)p; (void)v; (void)l; (void)ev; (void)early; (void)r; (void)nr; (void)e; (void)m; (void)u;
  return made();
}
Status fmi3GetContinuousStateDerivatives(void* c, double dx[], size_t n) { (void)n; return derivatives(c, dx); }
Status fmi3GetNumberOfContinuousStates(void* c, size_t* n) { (void)c; *n = 2; return 0; }
Status fmi3GetNumberOfEventIndicators(void* c, size_t* n) { (void)c; *n = 2; return 0; }
Status fmi3UpdateDiscreteStates(void* c, bool* again, bool* ends, bool* nominals, bool* values, bool* defined,
                                double* next) {
  House* h = c;
  event(h); *again = h->stage++ == 0; *ends = *nominals = *values = false; *defined = true; *next = h->next; return 0;
}
Status fmi3EnterStepMode(void* c) { (void)c; return 0; }
Status fmi3DoStep(void* c, double t, double s, bool keep, bool* events, bool* ends, bool* early, double* last) {
  (void)keep; *events = *ends = *early = false; *last = t + s;
  return advance(c, t + s) ? 0 : 3;
}
#define NOT_THERE(name) Status fmi3##name(void) { return 3; }
NOT_THERE(ActivateModelPartition) NOT_THERE(DeserializeFMUState) NOT_THERE(EnterConfigurationMode)
NOT_THERE(EvaluateDiscreteStates) NOT_THERE(ExitConfigurationMode) NOT_THERE(FreeFMUState)
NOT_THERE(GetAdjointDerivative) NOT_THERE(GetBinary) NOT_THERE(GetClock) NOT_THERE(GetDirectionalDerivative)
NOT_THERE(GetFMUState) NOT_THERE(GetFloat32) NOT_THERE(GetInt16) NOT_THERE(GetInt32) NOT_THERE(GetInt64)
NOT_THERE(GetInt8) NOT_THERE(GetIntervalDecimal) NOT_THERE(GetIntervalFraction)
NOT_THERE(GetNumberOfVariableDependencies) NOT_THERE(GetOutputDerivatives) NOT_THERE(GetShiftDecimal)
NOT_THERE(GetShiftFraction) NOT_THERE(GetString) NOT_THERE(GetUInt16) NOT_THERE(GetUInt32) NOT_THERE(GetUInt64)
NOT_THERE(GetUInt8) NOT_THERE(GetVariableDependencies) NOT_THERE(InstantiateScheduledExecution)
NOT_THERE(SerializeFMUState) NOT_THERE(SerializedFMUStateSize) NOT_THERE(SetBinary) NOT_THERE(SetClock)
NOT_THERE(SetDebugLogging) NOT_THERE(SetFMUState) NOT_THERE(SetFloat32) NOT_THERE(SetInt16) NOT_THERE(SetInt32)
NOT_THERE(SetInt64) NOT_THERE(SetInt8) NOT_THERE(SetIntervalDecimal) NOT_THERE(SetIntervalFraction)
NOT_THERE(SetShiftDecimal) NOT_THERE(SetShiftFraction) NOT_THERE(SetString) NOT_THERE(SetUInt16)
NOT_THERE(SetUInt32) NOT_THERE(SetUInt64) NOT_THERE(SetUInt8)
#else
typedef struct { Bool again, ends, nominals, values, defined; double next; } EventInfo;
const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
void* fmi2Instantiate(const char* n, int kind, const char* g, const char* p, const void* cb, Bool v, Bool l) {
  (void)n; (void)kind; (void)g; (void)p; (void)cb; (void)v; (void)l; return made();
}
Status fmi2SetupExperiment(void* c, Bool defined, double tolerance, double start, Bool stops, double stop) {
  (void)defined; (void)tolerance; (void)stops; (void)stop; ((House*)c)->time = start; return 0;
}
Status fmi2GetDerivatives(void* c, double dx[], size_t n) { (void)n; return derivatives(c, dx); }
Status fmi2NewDiscreteStates(void* c, EventInfo* info) {
  House* h = c;
  EventInfo told = {h->stage++ == 0, 0, 0, 0, 1, 0.0};
  event(h); told.next = h->next; *info = told; return 0;
}
Status fmi2DoStep(void* c, double t, double s, Bool keep) { (void)keep; return advance(c, t + s) ? 0 : 3; }
#define NOT_THERE(name) Status fmi2##name(void) { return 3; }
NOT_THERE(SetDebugLogging) NOT_THERE(GetInteger) NOT_THERE(GetString) NOT_THERE(SetInteger) NOT_THERE(SetString)
NOT_THERE(GetFMUstate) NOT_THERE(SetFMUstate) NOT_THERE(FreeFMUstate) NOT_THERE(SerializedFMUstateSize)
NOT_THERE(SerializeFMUstate) NOT_THERE(DeSerializeFMUstate) NOT_THERE(GetDirectionalDerivative)
NOT_THERE(SetRealInputDerivatives) NOT_THERE(GetRealOutputDerivatives) NOT_THERE(CancelStep) NOT_THERE(GetStatus)
NOT_THERE(GetRealStatus) NOT_THERE(GetIntegerStatus) NOT_THERE(GetBooleanStatus) NOT_THERE(GetStringStatus)
#endif
