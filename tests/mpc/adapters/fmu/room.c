/* A room for co-simulation, FMI 2.0: C dT/dt = UA (TOut - T) + k (TSup - T) + Q, in closed form over each step. */
#include <math.h>
#include <stdlib.h>

typedef void* fmi2Component;
typedef unsigned int fmi2ValueReference;
typedef int fmi2Boolean;
typedef int fmi2Status; /* 0 OK, 3 error */

enum { T_ROOM, HEAT, OUTDOOR_C, LOSS, POWER, SUPPLY_C, COUNT };
static const double CAPACITY = 1e6, EXCHANGE = 10.0, EFFICIENCY = 0.9;

typedef struct { double value[COUNT]; } Room;

const char* fmi2GetTypesPlatform(void) { return "default"; }
const char* fmi2GetVersion(void) { return "2.0"; }
fmi2Component fmi2Instantiate(const char* name, int kind, const char* guid, const char* folder, const void* callbacks,
                              fmi2Boolean visible, fmi2Boolean logging) {
  Room* room = calloc(1, sizeof(Room));
  (void)name; (void)kind; (void)guid; (void)folder; (void)callbacks; (void)visible; (void)logging;
  if (room) { room->value[T_ROOM] = 293.15; room->value[LOSS] = 100.0; room->value[SUPPLY_C] = 40.0; }
  return room;
}
void fmi2FreeInstance(fmi2Component c) { free(c); }
fmi2Status fmi2SetDebugLogging(fmi2Component c, fmi2Boolean on, size_t n, const char* const names[]) {
  (void)c; (void)on; (void)n; (void)names; return 0;
}
fmi2Status fmi2SetupExperiment(fmi2Component c, fmi2Boolean defined, double tolerance, double start,
                               fmi2Boolean stops, double stop) {
  (void)c; (void)defined; (void)tolerance; (void)start; (void)stops; (void)stop; return 0;
}
fmi2Status fmi2EnterInitializationMode(fmi2Component c) { (void)c; return 0; }
fmi2Status fmi2ExitInitializationMode(fmi2Component c) { (void)c; return 0; }
fmi2Status fmi2Terminate(fmi2Component c) { (void)c; return 0; }
fmi2Status fmi2Reset(fmi2Component c) { (void)c; return 3; } /* not every unit can */
fmi2Status fmi2GetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, double value[]) {
  Room* room = c;
  room->value[POWER] = room->value[HEAT] / EFFICIENCY;
  for (size_t i = 0; i < n; i++) value[i] = room->value[vr[i]];
  return 0;
}
fmi2Status fmi2SetReal(fmi2Component c, const fmi2ValueReference vr[], size_t n, const double value[]) {
  Room* room = c;
  for (size_t i = 0; i < n; i++) room->value[vr[i]] = value[i];
  return 0;
}
fmi2Status fmi2DoStep(fmi2Component c, double time, double step, fmi2Boolean keep) {
  double* v = ((Room*)c)->value;
  double conductance = v[LOSS] + EXCHANGE;
  double rest = (v[LOSS] * (v[OUTDOOR_C] + 273.15) + EXCHANGE * (v[SUPPLY_C] + 273.15) + v[HEAT]) / conductance;
  (void)time; (void)keep;
  if (v[HEAT] > 4900.0) return 3; /* a solver that gives up */
  v[T_ROOM] = rest + (v[T_ROOM] - rest) * exp(-conductance * step / CAPACITY);
  return 0;
}

#define NOT_THERE(name) fmi2Status name(void) { return 3; }
NOT_THERE(fmi2GetInteger) NOT_THERE(fmi2GetBoolean) NOT_THERE(fmi2GetString)
NOT_THERE(fmi2SetInteger) NOT_THERE(fmi2SetBoolean) NOT_THERE(fmi2SetString)
NOT_THERE(fmi2GetFMUstate) NOT_THERE(fmi2SetFMUstate) NOT_THERE(fmi2FreeFMUstate)
NOT_THERE(fmi2SerializedFMUstateSize) NOT_THERE(fmi2SerializeFMUstate) NOT_THERE(fmi2DeSerializeFMUstate)
NOT_THERE(fmi2GetDirectionalDerivative) NOT_THERE(fmi2SetRealInputDerivatives)
NOT_THERE(fmi2GetRealOutputDerivatives) NOT_THERE(fmi2CancelStep) NOT_THERE(fmi2GetStatus)
NOT_THERE(fmi2GetRealStatus) NOT_THERE(fmi2GetIntegerStatus) NOT_THERE(fmi2GetBooleanStatus)
NOT_THERE(fmi2GetStringStatus)
