#pragma once

#include <string>

namespace ensonify::tests {

/// The message of the exception of type Error that an action throws; `without` if it throws none.
template <class Error, class Action>
std::string message_thrown(const Action& action, const std::string& without = "") {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  return without;
}

}  // namespace ensonify::tests
