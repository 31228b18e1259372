# Gives the target sdg::sdg.
if(TARGET sdg::sdg)
  return()
endif()
get_filename_component(_sdg_prefix "${CMAKE_CURRENT_LIST_DIR}/../../.." ABSOLUTE)
add_library(sdg::sdg SHARED IMPORTED)
set_target_properties(sdg::sdg PROPERTIES
  IMPORTED_LOCATION "${_sdg_prefix}/lib/libsdg.so.@ABI@"
  IMPORTED_SONAME "libsdg.so.@ABI@"
  INTERFACE_INCLUDE_DIRECTORIES "${_sdg_prefix}/include")
unset(_sdg_prefix)
