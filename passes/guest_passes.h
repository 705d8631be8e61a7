// Hands this build's passes to the guest: defines guest::passes() of chain/guest/registry.h.
#pragma once

#include "chain/guest/registry.h"
