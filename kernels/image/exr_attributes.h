#pragma once
#include <string>
#include <string_view>

namespace reliefbench {

/// What the headers of an OpenEXR file claim, before OpenEXR sets memory aside for it: no attribute may be longer than
/// what is left of the file, nor have another size than its type has. (OpenEXR reads by the type, whatever the size
/// says, and then takes the middle of a value for the next attribute.) What else is wrong is left to OpenEXR.
/// file: all of it; name: for messages
/// throws: Error(bad_input)
void check_exr_attributes(std::string_view file, const std::string& name);

}  // namespace reliefbench
