# cmake --install DIR --prefix PREFIX: the program with its scripts, cases and pages. The installed tree stands alone.
# MPI, HDF5 and METIS are found where they were linked, as in folders of a cluster's modules.
set_target_properties(cairn PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
install(TARGETS cairn RUNTIME DESTINATION bin)
foreach(level IN LISTS levels)
  if(TARGET cairn_${level})
    set_target_properties(cairn_${level} PROPERTIES INSTALL_RPATH_USE_LINK_PATH ON)
    install(TARGETS cairn_${level} RUNTIME DESTINATION libexec/cairn)
  endif()
endforeach()
install(PROGRAMS scripts/plot scripts/measure scripts/view scripts/report scripts/export scripts/paraview scripts/python
        scripts/compare-runs scripts/convert-grains scripts/convert-labels scripts/convert-cells DESTINATION libexec/cairn)
install(DIRECTORY scripts/plotting scripts/measuring scripts/converting DESTINATION libexec/cairn
        FILES_MATCHING PATTERN *.py PATTERN viewer*)
install(DIRECTORY cases DESTINATION share/cairn)
install(DIRECTORY docs/ DESTINATION share/doc/cairn FILES_MATCHING PATTERN *.md PATTERN *.png)
install(FILES README.md LICENSE ARCHITECTURE.md CONTRIBUTING.md DESTINATION share/doc/cairn)
install(PROGRAMS scripts/slurm-example.sh DESTINATION share/doc/cairn)
install(FILES scripts/packaging/cairn.bash DESTINATION share/bash-completion/completions RENAME cairn)
install(FILES scripts/packaging/cairn.1 DESTINATION share/man/man1)
