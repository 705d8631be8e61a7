// What the pointers of the C interface point to.
#pragma once

#include <memory>
#include <string>

#include "chain/guest/chain_handle.h"
#include "chain/guest/instance.h"

struct pc_instance {
    std::unique_ptr<postchain::guest::Instance> is;
};

struct pc_chain {
    postchain::guest::ChainHandle is;
};

namespace postchain::guest {

// Of this thread's last attempt to make one of them.
std::string& create_error();

}  // namespace postchain::guest
