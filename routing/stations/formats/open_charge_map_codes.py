"""Codes and names of Open Charge Map: its reference data of 2021 (openchargemap.org, CC BY 4.0), as far as read."""

from __future__ import annotations

from types import MappingProxyType
from typing import Final

from energy.charging.charging import Connector
from routing.stations.station import Access

PLUGS: Final = MappingProxyType(
    {
        1: Connector.TYPE1,  # Type 1 (J1772)
        2: Connector.CHADEMO,  # CHAdeMO
        3: Connector.DOMESTIC,  # BS1363 3 Pin 13 Amp
        4: Connector.CEE,  # Blue Commando (2P+E)
        9: Connector.DOMESTIC,  # NEMA 5-20R
        10: Connector.DOMESTIC,  # NEMA 14-30
        11: Connector.DOMESTIC,  # NEMA 14-50
        13: Connector.DOMESTIC,  # Europlug 2-Pin (CEE 7/16)
        14: Connector.DOMESTIC,  # NEMA 6-20
        15: Connector.DOMESTIC,  # NEMA 6-15
        16: Connector.CEE,  # CEE 3 Pin
        17: Connector.CEE,  # CEE 5 Pin
        18: Connector.CEE,  # CEE+ 7 Pin
        22: Connector.DOMESTIC,  # NEMA 5-15R
        23: Connector.DOMESTIC,  # CEE 7/5
        25: Connector.TYPE2,  # Type 2 (Socket Only)
        26: Connector.TYPE3,  # SCAME Type 3C (Schneider-Legrand)
        28: Connector.DOMESTIC,  # CEE 7/4 - Schuko - Type F
        29: Connector.DOMESTIC,  # Type I (AS 3112)
        32: Connector.CCS1,  # CCS (Type 1)
        33: Connector.CCS2,  # CCS (Type 2)
        34: Connector.CEE,  # IEC 60309 3-pin
        35: Connector.CEE,  # IEC 60309 5-pin
        36: Connector.TYPE3,  # SCAME Type 3A (Low Power)
        1036: Connector.TYPE2,  # Type 2 (Tethered Connector)
        1037: Connector.DOMESTIC,  # T13 - SEC1011 ( Swiss domestic 3-pin ) - Type J
        1038: Connector.GBT_AC,  # GB-T AC - GB/T 20234.2 (Socket)
        1039: Connector.GBT_AC,  # GB-T AC - GB/T 20234.2 (Tethered Cable)
        1040: Connector.GBT_DC,  # GB-T DC - GB/T 20234.3
        1042: Connector.DOMESTIC,  # NEMA TT-30R
    }
)
TESLA_PLUGS: Final = frozenset((27, 30))  # of America, or type 2 that carries direct current elsewhere
UNKNOWN_PLUGS: Final = MappingProxyType(  # that no vehicle here has
    {
        0: "Unknown",
        5: "LP Inductive",
        6: "SP Inductive",
        7: "Avcon Connector",
        8: "Tesla (Roadster)",
        21: "XLR Plug (4 pin)",
        24: "Wireless Charging",
        31: "Tesla Battery Swap",
        1041: "Three Phase 5-Pin (AS/NZ 3123)",
    }
)
PHASES: Final = MappingProxyType({10: 1, 20: 3})  # by the type of current
DIRECT_CURRENT: Final = 30
LEVEL_W: Final = MappingProxyType(  # of what is known by its level alone
    {
        1: 1_800.0,  # "under 2 kW": 120 V and 15 A
        2: 3_700.0,  # "over 2 kW": 230 V and 16 A, the least of type 2; assumed
        3: 40_000.0,  # "40 kW and higher"
    }
)
FAST: Final = 3
ACCESS: Final = MappingProxyType(  # by the type of usage
    {
        1: Access.PUBLIC,
        2: Access.PRIVATE,  # private, restricted access
        3: Access.RESTRICTED,  # privately owned, notice required
        4: Access.PUBLIC,  # membership required
        5: Access.PUBLIC,  # pay at location
        6: Access.CUSTOMERS,  # private, for staff, visitors or customers
        7: Access.PUBLIC,  # notice required
    }
)
PAY_AT_LOCATION: Final = 5
OPERATIONAL: Final = MappingProxyType(  # by the type of status; what is missing here says nothing
    {10: True, 20: True, 30: False, 50: True, 75: True, 100: False}
)
GONE: Final = MappingProxyType({150: "planned", 200: "removed", 210: "removed"})
LEAST_DELISTED: Final = 1000  # types of submission status from here on are of what is off the list
NOT_LISTED: Final = frozenset((1, 250))  # under review, rejected
COUNTRIES: Final = MappingProxyType(  # whose plugs or money differ, by ISO 3166 code
    {
        2: "US",
        44: "CA",
        146: "MX",
        114: "JP",
        121: "KR",
        219: "TW",
        18: "AU",
        161: "NZ",
        168: "NO",
        216: "SE",
        65: "DK",
        105: "IS",
    }
)
NACS_COUNTRIES: Final = frozenset(("US", "CA", "MX", "JP", "KR", "TW"))
PROVIDERS: Final = MappingProxyType(  # name and licence; None where its data is not open or says nothing
    {
        1: ("Open Charge Map Contributors", "CC BY-SA 4.0"),
        2: ("afdc.energy.gov", "US Department of Energy, any purpose"),
        7: ("Mobie.pt", "public data by agreement"),
        8: ("ev-charging.com", None),
        13: ("www.uppladdning.nu", None),
        14: ("e-Laad", None),
        15: ("CarStations.com", None),
        17: ("BlinkNetwork.com", None),
        18: ("UK National Charge Point Registry", "OGL v2.0"),
        19: ("NOBIL", "CC BY 4.0"),
        20: ("Chargepoint.net", None),
        21: ("RWE Mobility", None),
        22: ("CHAdeMO.com", None),
        23: ("ESB eCars", None),
        24: ("AddÉnergie Technologies Inc.", "CC BY 3.0"),
        25: ("Catalan Energy Institute (ICAEN)", "general public data"),
        26: ("Oplaadpalen.nl", "CC BY-NC-SA 3.0"),
        27: ("Place To Plug", None),
        28: ("data.gouv.fr", "Licence Ouverte"),
        29: ("Bundesnetzagentur.de", "CC BY 4.0"),
    }
)
OPERATORS: Final = MappingProxyType(
    {
        2: "Elektrobay (UK)", 3: "POD Point (UK)", 5: "ChargePoint (Coulomb Technologies)",
        6: "Nissan US Dealer Network", 7: "Nissan UK Dealer Network", 8: "Chargemaster", 9: "Blink Network/ECOtality",
        11: "EVSE LLC WebNet", 12: "RechargeAccess", 13: "PETROL", 14: "Shorepower", 15: "eVgo Network",
        16: "Elektromotive (UK)", 18: "TIWAG Tiroler Wasserkraft AG (AT)", 19: "Zero Carbon World",
        20: "Charge Your Car", 21: "Mobie.pt", 22: "ESB Ecars", 23: "Tesla Motors (Worldwide)",
        24: "Electric Highway (UK)", 25: "Source London", 26: "AeroVironment", 28: "WEL Networks (NZ)", 29: "e-Laad",
        31: "Clipper Creek", 32: "BP Pulse", 33: "SDEY (Fr)", 34: "Westar Energy ElectroGo",
        35: "ThePluginCompany (Belgium)", 36: "Blue Corner (Belgium)", 38: "Lidl", 39: "SemaConnect",
        41: "MAGNE Charge", 42: "EATON", 43: "AVCON", 46: "E.ON (DE)", 47: "The New Motion (NL)",
        48: "RWE Mobility/Essent", 49: "EV-Point", 50: "Volta Charging", 51: "Sun Country Highway", 52: "Enovos",
        53: "Autolib (Paris)", 54: "ZE-MO (Be)", 55: "e-totem", 56: "Auto Bleue",
        57: "The REV Project (UWA - Australia)", 59: "GreenLots", 60: "Source East (UK)", 61: "Vitaemobility",
        62: "KiWhi Pass", 63: "Greenflux", 64: "Ultra-Fast", 65: "UWAG", 66: "Drehstromnetz", 67: "ElectroDrive",
        68: "Empora", 69: "ladenetz.de", 70: "Eşarj (TR)", 71: "Plugged In Midlands (UK)", 72: "RheinEnergie AG",
        73: "EV-Box", 74: "FastNed", 76: "ELMO", 77: "Ecoplug", 78: "Essent (NL)", 79: "Mobib (Belgium)",
        80: "Enel X", 81: "Silfi (Italy)", 82: "E-moving (Italy)", 83: "Ecospazio (Italy)",
        84: "Green Land Mobility (Italy)", 85: "FORTISIS", 86: "EnBW (D)", 87: "EVbility (Italy)", 88: "Greenway",
        89: "flo", 90: "Circuit Electrique", 91: "IBIL (Es)", 92: "MobecPoint (Es)", 93: "E-Car", 94: "BeCharged",
        95: "Helsingin Energia", 96: "ChargeLounge", 97: "Park & Charge (CH)", 98: "Park & Charge (D)", 99: "Vlotte",
        100: "ZenCar", 101: "ChargeIT mobility", 102: "Orka Náttúrunnar", 103: "Allego BV", 104: "RWE / Npower",
        105: "Innogy SE (RWE eMobility)", 106: "Ladefoxx", 107: "OpConnect", 108: "Vattenfall InCharge",
        109: "EWR gmbh e-mobile", 110: "EVite (ch)", 111: "Hong Kong EV Power",
        112: "MisterGreen, The Fast Charger Network", 113: "Sähköinenliikenne (fi)", 114: "Power Station", 115: "ČEZ",
        116: "G2mobility", 118: "AGSM Electrify Verona", 119: "Plug-In North Central Washington", 120: "JuicePoint",
        121: "EnerCity", 122: "Harz Energie", 123: "Stadtwerke Lübeck", 124: "Osterholzer Stadtwerke",
        125: "SWB / EWE", 126: "VR Schneller-Strom-tanken", 127: "EWE", 128: "LSW Energie", 129: "BS Energie",
        130: "Stadtwerke Wernigerode", 131: "Stadtwerke Northeim SWN", 132: "Stadtwerke Göttingen",
        133: "Rauman Energia", 134: "Stadtwerke Verden", 135: "Manx Electricity Authority", 136: "VIRTA",
        137: "EVS Energieversorgung Sylt", 138: "SUN Stadtwerke Union Nordhessen", 139: "Schleswiger Stadtwerke",
        140: "EAM", 141: "ElectroDrive Salzburg", 142: "TANKE Wien Energie", 143: "Stadtwerke Rinteln",
        144: "Versorgungsbetriebe Hann. Münden", 145: "EWI Energiewerke Isernhagen", 146: "Stadtwerke Hameln",
        147: "Stadtwerke Neumünster (SWN).", 148: "Stadtwerke Haldensleben SWH", 149: "Stadtwerke Soest",
        150: "The GeniePoint Network ( Engie EV Solutions )", 151: "Stadtwerke Grevesmühlen",
        152: "Städtische Werke Magdeburg", 153: "Stadtwerke Strahlsund", 154: "Stadtwerke Rostock",
        155: "Stadtwerke Leipzig SWL", 156: "The New Motion (DE)", 157: "The New Motion (BE)",
        158: "Stadtwerke Dessau", 159: "Stadtwerke Wittenberg", 160: "StromTicket", 161: "Stadtwerke Halle",
        162: "Stadtwerke Clausthal-Zellerfeld", 163: "GGEW", 164: "Neogy", 165: "Mainova",
        166: "Stadtwerke Wolfenbüttel", 167: "Nissan DE Freistrom", 169: "Stadtwerke Uetersen",
        170: "Stadtwerke Elmshorn", 171: "EEW Duderstadt", 172: "ENEWA", 173: "ChargeNow",
        174: "TOTAL Nl PlugToDrive", 175: "TOTAL Be PlugToDrive", 176: "ZEAG Energie", 177: "Nuon", 178: "EVnetNL",
        179: "Ecotap", 180: "Alfen", 181: "eNovates", 182: "Latvenergo", 183: "Wirtschaftsbetriebe Stadt Nienburg",
        184: "ElectroDrive/Mark-E (DE)", 185: "CLEVER", 186: "Azra Network", 187: "ELMŰ", 188: "OVAG Energie",
        189: "E-Wald", 190: "PRE (cz)", 191: "inChaNet", 192: "E.ON (CZ)", 193: "VSE",
        194: "RAC Electric Highway/ChargeStar", 195: "Werraenergie", 196: "Nomadpower", 197: "FLOW Charging",
        198: "Recharge (Formerly Fortum Charge & Drive)", 199: "EDP MOP", 200: "PRIOE", 201: "München Umland",
        202: "Charge & Drive (Fortum - NO)", 203: "Osprey Charging", 204: "GardaUno", 205: "Estonteca",
        206: "LIVE Barcelona", 207: "Endesa", 208: "eDrop", 209: "Estabanell Energia", 210: "GIC", 211: "sofos",
        212: "Amersam", 213: "Izivia (Sodetrel)", 214: "be emobil", 215: "Charge & Fuel", 216: "Enspirion",
        217: "RCS (Revitalize Charging Solutions)", 218: "Galactico.pl", 219: "Energieversorgung Buching-Trauchgau",
        220: "Stromnetz Hamburg", 221: "Evmapa (CZ)", 222: "ETOP", 223: "Schnell Laden Berlin", 224: "EnergieDienst",
        225: "Stadtwerke Münster", 226: "Green Frontiers (lk)", 227: "chargeNET (lk)", 228: "Spark EV (lk)",
        229: "charge.net.nz", 231: "Vibrate", 232: "electric-driving.colruytgroup.com", 233: "Vector (NZ)",
        234: "N-ERGIE", 235: "Stadtwerke Düsseldorf AG", 1235: "Belib’", 1236: "ORES", 1237: "Viesgo (Spain)",
        1238: "emma", 1239: "Polyfazer", 1240: "Pfalzwerke", 1241: "EasyGO (aka Carcharger.ie)",
        1242: "GE WattStation (No longer active)", 2241: "EWB", 2242: "RhönEnergie", 2243: "eins", 2244: "ubitricity",
        2245: "Schwabencard", 2246: "Slovenské elektrárne", 2247: "Iberdrola", 3247: "Grønn Kontakt",
        3248: "Tank & Rast", 3249: "Umeå Energi", 3250: "RPSnet", 3251: "E.ON (DK)", 3252: "NRG EVgo",
        3253: "SMATRICS Netz", 3254: "Evd Dormagen", 3255: "SODO", 3256: "USEDA (FR)", 3257: "Révéo (FR)",
        3258: "Elektro Ljublana", 3259: "ZSE (SK)", 3260: "Energie der Eifel", 3261: "Be Energised (has-to-be)",
        3262: "SDE76 (FR)", 3263: "DEWA", 3264: "EE-Mobil", 3265: "REWAG", 3266: "PlugSurfing",
        3267: "Duferco Energie", 3268: "Belorusneft", 3269: "Stromtreter", 3270: "Stromtreter",
        3271: "e-Charge (Romania)", 3272: "EVPass (CH)", 3273: "Swisscharge (CH)", 3274: "MOVE (CH)", 3275: "Renault",
        3276: "EDP", 3277: "Syane", 3278: "Urbener Energía", 3279: "Fenie Energía (Spain)", 3280: "Plug n Roll",
        3281: "Effia", 3282: "Emobitaly (Italy)", 3283: "MELIB (ES)", 3284: "autoPilDYK", 3285: "Kelag AG",
        3286: "Lenenergo", 3287: "Ella", 3288: "Jersey Electricity Evolve", 3289: "MVM Partner Zrt.",
        3290: "State Grid Corporation of China (SGCC)", 3291: "Evway", 3292: "Badenova (DE)", 3293: "Revolta Egypt",
        3294: "EAC e-charge", 3295: "evcharge.online", 3296: "InstaVolt Ltd", 3297: "Entega", 3298: "EO Charging",
        3299: "Ionity", 3300: "YPF", 3301: "МОЭСК (Russia)", 3302: "Easypark", 3303: "Avacon", 3304: "Celsia",
        3305: "AMB (Àrea metropolitana de Barcelona)", 3306: "Trenčiansky samosprávny kraj", 3307: "NKM mobiliti",
        3308: "SIEL", 3309: "echargenet - State Grid Corportation of China", 3310: "Chargestar (AU)", 3311: "Elen",
        3312: "EDF", 3313: "GOFAST (Gotthard Fastcharge)", 3314: "Easy4You", 3315: "Chargeplace Scotland",
        3316: "Drive Eco", 3317: "Queensland Electric Super Highway", 3318: "Electrify America", 3319: "E-Mobi",
        3320: "da emobil", 3321: "Chargy (LU)", 3322: "Parking Energy", 3323: "ZES", 3324: "EasyCharger",
        3325: "EWP : Energie und Wasser Potsdam GmbH", 3326: "Alfapower (UK)", 3327: "Be Charge (Italy)",
        3328: "ZapGrid", 3329: "SpotLink – e.motion", 3330: "Repower (Italy)", 3331: "BLUETORINO", 3332: "Driwe",
        3333: "AAE", 3334: "Gnrgy", 3335: "RedePiloto", 3336: "Alizé", 3338: "chargEV", 3339: "Chargefox",
        3340: "Veolia", 3341: "Swarco E.Connect", 3342: "Ekomobil", 3343: "Incharge", 3344: "YASNO E-mobility",
        3345: "Char.gy", 3346: "Noodoe EV", 3347: "Seom", 3348: "Level2.ee", 3349: "City EV",
        3350: "ЕВН (EVN) (Macedonia)", 3351: "EVL (de)", 3352: "Axpo Energy Solutions Italia", 3353: "Plugit",
        3354: "K Lataus", 3355: "Motolataus", 3356: "Hubsta", 3357: "ESB EV-Solutions (UK)",
        3358: "Putevi Srbije / ЈП Путеви Србије / Roads of Serbia", 3359: "E.ON (HU)",
        3360: "CNR (Compagnie Nationale du Rhône)", 3361: "Toka Energy", 3362: "Autoenterprise / АвтоЭнтерпрайз",
        3363: "Midgard Electric", 3364: "Copec Voltex", 3365: "NBP eCharge Network", 3366: "Tonik Energy",
        3367: "Sharz.Net", 3368: "Elocity", 3369: "Comfortcharge", 3370: "Enerhub", 3371: "Wenea", 3372: "EV Connect",
        3373: "Webasto", 3374: "ChargeGrid", 3375: "Petro Canada", 3376: "SAEV", 3377: "Etecnic", 3378: "MOL",
        3379: "Freshmile", 3380: "SDEG 16 (Syndicat Départemental d'Electricité et de Gaz de la Charente)",
        3381: "eTecnic", 3382: "Wroom", 3383: "AlterBase - Sorégies (FR)", 3384: "Hrvatski Telekom", 3385: "BC Hydro",
        3386: "GridCars", 3387: "Last Mile Solutions", 3388: "NRMA", 3389: "EVGateway", 3390: "Electroukraine",
        3391: "Electric Blue UK", 3392: "Shell UK Oil Products Limited", 3393: "Joju Ltd", 3394: "Eneco",
        3395: "Optimum Way", 3396: "Orlencharge", 3397: "PGE Nowa Energia", 3398: "Evie",
        3399: "EV Energy Group (FCN)", 3400: "Electrify Canada", 3401: "Electromaps", 3402: "GoCharge (IE)",
        3403: "E.ON Drive", 3404: "Grupo ICE", 3405: "Enercharge", 3406: "Electric Highway Tasmania", 3407: "MObiVE",
        3408: "eborn", 3409: "pass pass électrique", 3410: "Alizé Liberté", 3411: "La Borne", 3412: "Sydego",
        3413: "EcoCharge77", 3414: "Elinta Charge", 3415: "ejoin", 3416: "IVY", 3417: "myEVroute",
        3418: "evconnect.ro", 3419: "EV-Mag", 3420: "plugpoint.ro", 3421: "Rompetrol", 3422: "eondrive.ro",
        3423: "Westfalen Weser Netz", 3424: "EV Direct", 3425: "OlifeEnergy", 3426: "Blink Charging Europe",
        3427: "EVziiin", 3428: "EV Loader", 3429: "Q1 Autostrom", 3430: "GridServe", 3431: "Continente Plug&Charge",
        3432: "Volthero", 3433: "Sonol-evi (Israel)", 3434: "EVEdge (Israel)", 3435: "Afcon (Israel)",
        3436: "Tata Power", 3437: "Elli (Volkswagen Group Charging GmbH)", 3438: "NRG4YOU", 3439: "Voltrun",
        3440: "HeraRicarica Pubblica", 3441: "Blue Marble Charging", 3442: "e-VOLTT", 3443: "BIGGIE Energie",
        3444: "eways", 3445: "EDP Plug & Go", 3446: "EV Dot", 3447: "Total EV Charge",
        3448: "ZEN (Zero Emission Network)/PROVIRIDIS", 3449: "ePower", 3450: "GO+EAuto",
        3451: "Greenway Polska (PL)", 3452: "TAURON Nowe Technologie", 3453: "PKP Mobility", 3454: "ZEF Energy",
        3455: "Aral pulse", 3456: "Manaseer", 3457: "ION (Jordan)", 3458: "JoPetrol", 3459: "Cargacoches",
        3460: "PEA Volta", 3461: "Enex E-Pro", 3462: "TEA.", 3463: "AIMove", 3464: "ALDI SÜD",
        3466: "Next Step Mobility (DE)",
    }
)  # fmt: skip
NO_OPERATORS: Final = frozenset((1, 44, 45))  # unknown, a private person, the business at the place
