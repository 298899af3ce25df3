"""The operator's page in the browser, and the answers to it that are no messages of the owner.

``page/`` has the files of the browser: plain modules of JavaScript, begun by ``js/main.js``, with
three.js and uPlot in ``vendor/``. ``assets`` reads them all once. The gateway
(:mod:`bioscara.web`) serves them, and the answers of the other modules, after its checks.
"""
