import sys
import nptdms.log, logging
from nptdms import TdmsFile
nptdms.log.log_manager.set_level(logging.DEBUG)
TdmsFile.read(sys.argv[1])
