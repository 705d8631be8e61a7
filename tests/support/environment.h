// Variables of this process's environment.
#pragma once

#include <stdlib.h>

#include <string>

namespace postchain::test {

// Empty: removes it.
inline void set_variable(const char* name, const std::string& value) {
#ifdef _WIN32
    _putenv_s(name, value.c_str());
#else
    if (value.empty())
        unsetenv(name);
    else
        setenv(name, value.c_str(), 1);
#endif
}

}  // namespace postchain::test
