// What `atlas ingest` tells of the sessions that it uploaded to, as they are afterwards.
#pragma once

#include <ostream>

#include <boost/json/value.hpp>

#include "client/drive/lasting_upload.h"

namespace atlas {

// An array with an object for each; null where the daemon could not be asked.
boost::json::value SessionStatesJson(const LastingUploadReport& upload);

// Notes for people: what the upload alone would not have left, and that nobody could be asked.
void PrintSessionNotes(const LastingUploadReport& upload, std::ostream& err);

}  // namespace atlas
