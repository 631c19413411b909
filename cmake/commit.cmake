# Writes the commit of the source tree to a header, at each build: cmake -D SOURCE=... -D OUTPUT=... -P
execute_process(COMMAND git -C ${SOURCE} describe --always --dirty OUTPUT_VARIABLE commit
                OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
file(CONFIGURE OUTPUT ${OUTPUT} CONTENT "#define ENSONIFY_COMMIT \"@commit@\"\n" @ONLY)
