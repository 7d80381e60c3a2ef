// JSON as the command line prints it: one line, numbers as people write them (5.49, not 5.49E0).
#pragma once

#include <string>

#include <boost/json/value.hpp>

namespace atlas {

// Shortest digits that read back as the same double; a number that is not finite becomes null.
std::string JsonText(const boost::json::value& value);

// `value` to `decimals` places, for figures whose further digits say nothing.
double Rounded(double value, int decimals);

}  // namespace atlas
