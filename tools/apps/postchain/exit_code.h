// Exit codes of the command (docs/command.md lists them).
#pragma once

#include "chain/status.h"

namespace postchain {

inline constexpr int kExitOk = 0;
inline constexpr int kExitSomeFailed = 1;  // some frames failed
inline constexpr int kExitUsage = 2;
inline constexpr int kExitChain = 3;
inline constexpr int kExitInput = 4;
inline constexpr int kExitOutput = 5;
inline constexpr int kExitGl = 6;
inline constexpr int kExitHealth = 7;
inline constexpr int kExitThreshold = 8;  // an error metric exceeds --fail-above
inline constexpr int kExitSignal = 128;   // + the signal's number

inline int exit_code(const Status& status) {
    switch (status.code()) {
        case StatusCode::ok:
            return kExitOk;
        case StatusCode::usage:
            return kExitUsage;
        case StatusCode::chain:
            return kExitChain;
        case StatusCode::input:
            return kExitInput;
        case StatusCode::output:
            return kExitOutput;
        case StatusCode::gl:
            return kExitGl;
        case StatusCode::health:
            return kExitHealth;
        case StatusCode::canceled:
        case StatusCode::internal:
            return kExitSomeFailed;
    }
    return kExitSomeFailed;
}

}  // namespace postchain
