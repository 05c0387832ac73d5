// volk's functions, compiled once.
#define VOLK_IMPLEMENTATION
#include <volk.h>
