// Hands this build's passes to the guest: defines guest::passes() of chain/guest/chain_handle.h.
#pragma once

#include "chain/guest/chain_handle.h"
